//! `cargo lab session`: what a frame of a session costs beside its kernels, and whether its memory stays what it was.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
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

use crate::origin::commit;
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

/// Options of `cargo lab session`.
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
    /// Only print the milliseconds to the first frame of a technique, with pipelines kept in a folder: what the report starts anew for each of
    /// them, because a driver keeps what it has compiled in this process.
    #[arg(long, hide = true, num_args = 2, value_names = ["NAME", "FOLDER"])]
    first_frame: Option<Vec<String>>,
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
    let executor = GpuExecutor::builder().adapter(options.adapter.as_deref()).open()?;
    if let Some([name, folder]) = options.first_frame.as_deref() {
        let [built, made, shown] = first_frame(&executor, technique::named(name)?, Path::new(folder))?;
        println!("{built} {made} {shown}");
        return Ok(());
    }
    let mut text = format!(
        "# What a session costs\n\nMade by `cargo lab session --write` at commit {} on {}. {} objects of {} triangles each, techniques with \
         their default settings, {} x {} pixels, medians of {} frames.\n\n",
        commit(),
        executor.describe().adapter.unwrap_or_default(),
        SIDE * SIDE,
        sphere().indices.len(),
        SIZE[0],
        SIZE[1],
        options.frames
    );
    text += &first_frames(options)?;
    text += &frames(&executor, options.frames)?;
    let (memory, grows) = memory(&executor)?;
    text += &memory;
    report::publish("session", &text, options.write)?;
    report::judge("memory of sessions", grows)
}

/// What a command prints.
fn output(command: &mut Command) -> Result<String, Error> {
    let name = command.get_program().to_string_lossy().into_owned();
    let failed = |why: &str| Error::Failed(format!("{name} fails: {}", why.trim()));
    let output = command.output().map_err(|error| failed(&error.to_string()))?;
    let [said, complaint] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    if output.status.success() { Ok(said) } else { Err(failed(&complaint)) }
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

/// The techniques whose frames reuse each other.
fn techniques() -> impl Iterator<Item = Box<dyn Technique>> {
    technique::all().into_iter().filter(|technique| technique.looks_back())
}

fn session(
    executor: &GpuExecutor,
    scene: &Scene,
    technique: Box<dyn Technique>,
    cache: Option<&Path>,
) -> Result<GpuSession, Error> {
    let pipelines = Pipelines::new(executor.device(), Flavour::Exact, Shaders::Embedded);
    let pipelines = if let Some(folder) = cache { pipelines.kept_in(folder) } else { pipelines };
    let setup = Setup::new(SceneBuffers::build_editable(scene)?, technique, SIZE);
    Ok(GpuSession::new(executor.device(), pipelines, setup)?)
}

/// Submits what `record` records and waits: what that gives, and milliseconds until it was recorded and until it was done.
fn submitted<T>(
    executor: &GpuExecutor,
    record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<T, restir_host::Error>,
) -> Result<(T, f64, f64), Error> {
    let start = Instant::now();
    let mut encoder = executor.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let made = record(&mut encoder)?;
    let recorded = milliseconds(start);
    executor.queue().submit([encoder.finish()]);
    let polled = executor.device().poll(wgpu::PollType::wait_indefinitely());
    polled.map_err(|error| Error::Failed(format!("the adapter stopped answering: {error}")))?;
    Ok((made, recorded, milliseconds(start)))
}

/// Milliseconds to build the scene, to make the session, and to see the first frame.
fn first_frame(executor: &GpuExecutor, technique: Box<dyn Technique>, folder: &Path) -> Result<[f64; 3], Error> {
    let scene = scene()?;
    let start = Instant::now();
    SceneBuffers::build_editable(&scene)?;
    let built = milliseconds(start);
    let start = Instant::now();
    let mut session = session(executor, &scene, technique, Some(folder))?;
    let made = milliseconds(start) - built;
    let (_, _, shown) = submitted(executor, |encoder| session.frame(encoder, &View::default()))?;
    Ok([built, made, shown])
}

/// In a process of its own with nothing kept, neither by the driver nor in a file, and in another one with what the first left.
fn first_frames(options: &Options) -> Result<String, Error> {
    let mut text = String::from(
        "| the first frame | caches | building the scene | making the session | the frame |\n|---|---|---:|---:|---:|\n",
    );
    let program =
        std::env::current_exe().map_err(|error| Error::Failed(format!("this program is nowhere: {error}")))?;
    for technique in techniques() {
        let name = technique.about().name;
        let folder = tempfile::tempdir().map_err(|error| Error::Failed(format!("no temporary folder: {error}")))?;
        for caches in ["cold", "warm"] {
            let mut child = Command::new(&program);
            child.args(["session", "--first-frame", name]).arg(folder.path());
            child.args(options.adapter.iter().flat_map(|name| ["--adapter", name]));
            let said = output(child.env("MESA_SHADER_CACHE_DIR", folder.path().join("driver")))?;
            let times: Vec<f64> = said.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            let [built, made, shown] = times[..] else {
                return Err(Error::Failed(format!("the first frame of {name} says {said:?}")));
            };
            let _ = writeln!(text, "| {name} | {caches} | {built:.0} ms | {made:.0} ms | {shown:.0} ms |");
        }
    }
    text += "\n*Cold* is a new process with nothing kept by the driver or in the file of pipelines, *warm* one after it. Before, each has opened \
             the device with its self-check, whose kernels are specialised to another scene.\n\n";
    Ok(text)
}

/// Medians over frames of a situation.
struct Medians {
    refit: f64,
    rebuild: f64,
    recording: f64,
    frame: f64,
    /// Of the same kernels, without what the frame uploads.
    kernels: f64,
    uploaded: f64,
}

/// Milliseconds and bytes of frames, in turns.
fn frames(executor: &GpuExecutor, count: u32) -> Result<String, Error> {
    let mut text = String::from(
        "*Recording* is all that the session does on the CPU before a frame is submitted, and the scene's refit is part of it; a *frame* ends \
         when the device has done it; *kernels* are the same passes once more, without uploads; what the session *adds* is the frame less the \
         kernels. The refit is also told in parts of building the scene anew.\n\n\
         | technique | what happens | refit | of a rebuild | recording | frame | kernels | adds | uploaded |\n\
         |---|---|---:|---:|---:|---:|---:|---:|---:|\n",
    );
    for technique in techniques() {
        for situation in SITUATIONS {
            let Medians { refit, rebuild, recording, frame, kernels, uploaded } =
                medians(executor, count, technique.clone(), situation)?;
            let share = if rebuild > 0.0 { format!("{:.3}", refit / rebuild) } else { "-".to_owned() };
            let (name, adds) = (technique.about().name, frame - kernels);
            let _ = writeln!(
                text,
                "| {name} | {} | {refit:.2} ms | {share} | {recording:.2} ms | {frame:.1} ms | {kernels:.1} ms | {adds:.1} ms | {:.1} kB |",
                situation.0,
                uploaded / 1e3
            );
        }
    }
    Ok(text + "\n")
}

fn medians(
    executor: &GpuExecutor,
    count: u32,
    technique: Box<dyn Technique>,
    (_, camera_moves, moving): (&str, bool, usize),
) -> Result<Medians, Error> {
    let mut scene = scene()?;
    let first = scene.instances.len() - SIDE * SIDE;
    let mut session = session(executor, &scene, technique, None)?;
    let camera = session.setup().scene.camera;
    let mut columns: [Vec<f64>; 6] = Default::default();
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
        let (begun, recording, frame) = submitted(executor, |encoder| session.frame(encoder, &view))?;
        let ((), _, kernels) = submitted(executor, |encoder| session.repeat_kernels(encoder))?;
        let start = Instant::now();
        if moving > 0 {
            SceneBuffers::build_editable(&scene)?;
        }
        let rebuild = milliseconds(start);
        // the first two frames fill both parts of the arenas
        if index >= 2 {
            let values = [refit, rebuild, recording, frame, kernels, begun.uploaded as f64];
            columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
        }
    }
    let [refit, rebuild, recording, frame, kernels, uploaded] = columns.each_mut().map(|values| median(values));
    let rebuild = if moving > 0 { rebuild } else { 0.0 };
    Ok(Medians { refit, rebuild, recording, frame, kernels, uploaded })
}

/// Resident memory of this process in bytes; zero where the system does not say.
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    status.split_whitespace().nth(1).and_then(|pages| pages.parse::<u64>().ok()).unwrap_or_default() * 4096
}

/// Everything moves; what is uploaded and not freed would be seen.
fn memory(executor: &GpuExecutor) -> Result<(String, Option<String>), Error> {
    let scene = Scene::load("moving")?;
    let technique = techniques().next().ok_or_else(|| Error::Failed("no technique reuses frames".to_owned()))?;
    let name = technique.about().name;
    let setup = Setup::new(SceneBuffers::build_editable(&scene.at(0.0))?, technique, [8, 6]);
    let pipelines = Pipelines::new(executor.device(), Flavour::Exact, Shaders::Embedded);
    let mut session = GpuSession::new(executor.device(), pipelines, setup)?;
    let moments: Vec<Scene> = (0..32).map(|frame| scene.at(f64::from(frame))).collect();
    let (mut uploaded, mut looked_at) = (0, Vec::new());
    for index in 1..=MANY {
        let change = SceneChange::Edited(&moments[index as usize % moments.len()]);
        let view = View { scene: change, ..View::default() };
        uploaded += submitted(executor, |encoder| session.frame(encoder, &view))?.0.uploaded;
        if [FEW, MANY / 10, MANY].contains(&index) {
            looked_at.push([u64::from(index), session.bytes(), resident(), uploaded]);
        }
    }
    let mut text = format!(
        "A scene that moves all the time by {name}, at 8 x 6 pixels:\n\n\
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
