//! `cargo xtask session`: what a frame of a session costs beside its kernels, and whether its memory stays what it was.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use clap::Args;
use restir_host::Shaders;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::gpu::Pipelines;
use restir_host::exec::{Executor, Flavour, GpuExecutor};
use restir_host::scene::{Camera, Instance, Mesh, Scene};
use restir_host::session::{GpuSession, SceneChange, Setup, View};
use restir_host::technique::{self, Technique};
use restir_host::wgpu;
use restir_shared::glam::{DAffine3, DVec3};

use crate::{Error, report};

/// Objects along each side of a square, and triangles of each.
const SIDE: usize = 10;
const RINGS: u32 = 25;
const SECTORS: u32 = 42;
/// Pixels of the measured frames: few, so that the kernels do not hide what is beside them.
const SIZE: [u32; 2] = [64, 48];
/// Frames of the measurement of memory, and after how many of them it is first looked at.
const MANY: u32 = 10_000;
const FEW: u32 = 10;

/// Options of `cargo xtask session`.
#[derive(Args)]
pub struct Options {
    /// Part of the adapter's name; the first adapter by default.
    #[arg(long)]
    adapter: Option<String>,
    /// Frames of which the medians are taken.
    #[arg(long, default_value_t = 31)]
    frames: u32,
    /// Write the report to docs/session.md.
    #[arg(long)]
    write: bool,
}

/// What happens between two frames.
const SITUATIONS: [(&str, bool, usize); 4] = [
    ("nothing moves", false, 0),
    ("the camera moves", true, 0),
    ("one of 100 objects moves", false, 1),
    ("camera and all objects move", true, SIDE * SIDE),
];

/// Measures, prints the report, and writes it where asked.
///
/// # Errors
/// [`Error::Host`] without an adapter; [`Error::Failed`] if memory grows.
pub fn run(options: &Options) -> Result<(), Error> {
    let executor = GpuExecutor::open(options.adapter.as_deref(), Flavour::Exact, Shaders::Embedded)?;
    let mut text = format!(
        "# What a session costs\n\nMade by `cargo xtask session --write` on {}. {} objects of {} triangles each, the technique {} with its default \
         settings, {} x {} pixels, medians of {} frames.\n\n",
        executor.describe().adapter.unwrap_or_default(),
        SIDE * SIDE,
        sphere().indices.len(),
        technique()?.about().name,
        SIZE[0],
        SIZE[1],
        options.frames
    );
    text += &first_frames(&executor)?;
    text += &frames(&executor, options.frames)?;
    let (memory, grows) = memory(&executor)?;
    text += &memory;
    report::publish("session", &text, options.write)?;
    report::judge("memory of sessions", grows)
}

/// A sphere of radius 1, without normals.
fn sphere() -> Mesh {
    let point = |ring: u32, sector: u32| {
        let (polar, azimuth) = (
            f64::from(ring) / f64::from(RINGS) * std::f64::consts::PI,
            f64::from(sector) / f64::from(SECTORS) * std::f64::consts::TAU,
        );
        [polar.sin() * azimuth.cos(), polar.cos(), polar.sin() * azimuth.sin()].map(|x| x as f32)
    };
    let positions = (0..=RINGS).flat_map(|ring| (0..SECTORS).map(move |sector| point(ring, sector))).collect();
    let at = |ring: u32, sector: u32| ring * SECTORS + sector % SECTORS;
    let quads = (0..RINGS).flat_map(|ring| (0..SECTORS).map(move |sector| (ring, sector)));
    let triangles = quads.flat_map(|(ring, sector)| {
        let [a, b, c, d] = [at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1), at(ring, sector + 1)];
        let is_cap = [ring + 1 == RINGS, ring == 0];
        [[a, b, c], [a, c, d]].into_iter().zip(is_cap).filter(|(_, is_cap)| !is_cap).map(|(triangle, _)| triangle)
    });
    Mesh { indices: triangles.collect(), positions, ..Mesh::default() }
}

/// Spheres in the Cornell box, whose own objects stay.
fn scene() -> Result<Scene, Error> {
    let mut scene = Scene::load("cornell")?;
    let mesh = scene.meshes.len();
    scene.meshes.push(Arc::new(Mesh { name: "sphere".to_owned(), ..sphere() }));
    let place = |index: usize| {
        let along = |at: usize| (at as f64 + 0.5) / SIDE as f64 * 1.6 - 0.8;
        let at = DVec3::new(along(index % SIDE), -0.8, along(index / SIDE));
        Instance::new(mesh, DAffine3::from_translation(at) * DAffine3::from_scale(DVec3::splat(0.06)))
    };
    scene.instances.extend((0..SIDE * SIDE).map(place));
    Ok(scene)
}

fn milliseconds(start: Instant) -> f64 {
    1e3 * start.elapsed().as_secs_f64()
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The first technique whose frames reuse each other.
fn technique() -> Result<Box<dyn Technique>, Error> {
    let found = technique::all().into_iter().find(|technique| technique.looks_back());
    found.ok_or_else(|| Error::Failed("no technique reuses frames".to_owned()))
}

fn session(executor: &GpuExecutor, scene: &Scene, cache: Option<&Path>) -> Result<GpuSession, Error> {
    let pipelines = Pipelines::new(executor.device(), Flavour::Exact, Shaders::Embedded);
    let pipelines = if let Some(folder) = cache { pipelines.kept_in(folder) } else { pipelines };
    let setup = Setup::new(SceneBuffers::build_editable(scene)?, technique()?, SIZE);
    Ok(GpuSession::new(executor.device(), pipelines, setup)?)
}

/// Records a frame, submits it and waits: milliseconds of both, and bytes that were uploaded.
fn frame(executor: &GpuExecutor, session: &mut GpuSession, view: &View<'_>) -> Result<(f64, f64, u64), Error> {
    let start = Instant::now();
    let mut encoder = executor.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let begun = session.frame(&mut encoder, view)?;
    let recorded = milliseconds(start);
    executor.queue().submit([encoder.finish()]);
    let polled = executor.device().poll(wgpu::PollType::wait_indefinitely());
    polled.map_err(|error| Error::Failed(format!("the adapter stopped answering: {error}")))?;
    Ok((recorded, milliseconds(start), begun.uploaded))
}

/// With nothing kept of pipelines, and with what the first run left.
fn first_frames(executor: &GpuExecutor) -> Result<String, Error> {
    let folder = tempfile::tempdir().map_err(|error| Error::Failed(format!("no temporary folder: {error}")))?;
    let scene = scene()?;
    let mut text = String::from(
        "| the first frame | building the scene | making the session | the frame |\n|---|---:|---:|---:|\n",
    );
    for name in ["no pipeline is kept", "pipelines are kept"] {
        let start = Instant::now();
        SceneBuffers::build_editable(&scene)?;
        let built = milliseconds(start);
        let start = Instant::now();
        let mut session = session(executor, &scene, Some(folder.path()))?;
        let made = milliseconds(start) - built;
        let (_, shown, _) = frame(executor, &mut session, &View::default())?;
        let _ = writeln!(text, "| {name} | {built:.0} ms | {made:.0} ms | {shown:.0} ms |");
    }
    Ok(text + "\n")
}

/// Milliseconds and bytes of frames, in turns.
fn frames(executor: &GpuExecutor, count: u32) -> Result<String, Error> {
    let source = scene()?;
    let mut rebuilds = Vec::new();
    let mut rows = Vec::new();
    for (name, camera_moves, moving) in SITUATIONS {
        let mut scene = source.clone();
        let first = scene.instances.len() - SIDE * SIDE;
        let mut session = session(executor, &scene, None)?;
        let camera = session.setup().scene.camera;
        let (mut refits, mut recorded, mut shown, mut bytes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for index in 0..count + 2 {
            let step = f64::from(index) * 1e-3;
            for instance in &mut scene.instances[first..first + moving] {
                instance.transform.translation.y += 1e-3;
            }
            let position = camera.position + if camera_moves { step } else { 0.0 };
            let change = if moving > 0 { SceneChange::Edited(&scene) } else { SceneChange::None };
            let view = View { camera: Some(Camera { position, ..camera }), scene: change, ..View::default() };
            let start = Instant::now();
            if moving > 0 {
                session.setup().scene.refit(&scene)?;
            }
            let refit = milliseconds(start);
            let times = frame(executor, &mut session, &view)?;
            if moving == 1 {
                let start = Instant::now();
                SceneBuffers::build_editable(&scene)?;
                rebuilds.push(milliseconds(start));
            }
            // the first two frames fill both parts of the arenas
            if index >= 2 {
                refits.push(refit);
                recorded.push(times.0);
                shown.push(times.1);
                bytes.push(times.2 as f64);
            }
        }
        rows.push((name, [&mut refits, &mut recorded, &mut shown, &mut bytes].map(|values| median(values))));
    }
    let rebuild = median(&mut rebuilds);
    let mut text = format!(
        "Building the scene anew takes {rebuild:.1} ms. *Recording* is all that the session does on the CPU before a frame is submitted, and \
         the scene's refit is part of it; a *frame* ends when the device has done it.\n\n\
         | what happens | refit | of a rebuild | recording | frame | uploaded |\n|---|---:|---:|---:|---:|---:|\n"
    );
    for (name, [refit, recorded, shown, bytes]) in rows {
        let share = refit / rebuild;
        let _ = writeln!(
            text,
            "| {name} | {refit:.2} ms | {share:.3} | {recorded:.2} ms | {shown:.1} ms | {:.1} kB |",
            bytes / 1e3
        );
    }
    Ok(text + "\n")
}

/// Resident memory of this process in bytes; zero where the system does not say.
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    status.split_whitespace().nth(1).and_then(|pages| pages.parse::<u64>().ok()).unwrap_or_default() * 4096
}

/// Everything moves; what is uploaded and not freed would be seen.
fn memory(executor: &GpuExecutor) -> Result<(String, Option<String>), Error> {
    let scene = Scene::load("moving")?;
    let setup = Setup::new(SceneBuffers::build_editable(&scene.at(0.0))?, technique()?, [8, 6]);
    let pipelines = Pipelines::new(executor.device(), Flavour::Exact, Shaders::Embedded);
    let mut session = GpuSession::new(executor.device(), pipelines, setup)?;
    let moments: Vec<Scene> = (0..32).map(|frame| scene.at(f64::from(frame))).collect();
    let (mut uploaded, mut looked_at) = (0, Vec::new());
    for index in 1..=MANY {
        let change = SceneChange::Edited(&moments[index as usize % moments.len()]);
        uploaded += frame(executor, &mut session, &View { scene: change, ..View::default() })?.2;
        if [FEW, MANY / 10, MANY].contains(&index) {
            looked_at.push([u64::from(index), session.bytes(), resident(), uploaded]);
        }
    }
    let mut text = String::from(
        "A scene that moves all the time, at 8 x 6 pixels:\n\n\
         | frames | bytes of buffers | resident memory of the process | uploaded so far |\n|---:|---:|---:|---:|\n",
    );
    for [frames, bytes, resident, uploaded] in &looked_at {
        let [resident, uploaded] = [resident, uploaded].map(|&bytes| bytes as f64 / 1e6);
        let _ = writeln!(text, "| {frames} | {bytes} | {resident:.1} MB | {uploaded:.1} MB |");
    }
    let [few, many] = [looked_at[0], looked_at[2]];
    // what leaked would be all of the uploads
    let leaks = many[2].saturating_sub(looked_at[1][2]) > (uploaded - looked_at[1][3]) / 20;
    let grows = (many[1] != few[1] || leaks).then(|| format!("{few:?} after {FEW} frames, {many:?} after {MANY}"));
    Ok((text, grows))
}
