//! Sessions: the same bits as renders, on every device, whatever happens between two frames.

use libtest_mimic::Failed;
use restir_host::Error;
use restir_host::Shaders;
use restir_host::buffers::SceneBuffers;
use restir_host::denoise::Denoise;
use restir_host::exec::gpu::Pipelines;
use restir_host::exec::{CpuExecutor, Flavour, GpuExecutor};
use restir_host::image::Image;
use restir_host::render::Render;
use restir_host::scene::{AlphaMode, Camera, Scene};
use restir_host::session::{Begun, CpuSession, GpuSession, History, SceneChange, Setup, View};
use restir_host::settings::Choice as _;
use restir_host::technique::path::{PathSettings, Subsurface};
use restir_host::technique::restir_di::{DiSettings, MAX_CANDIDATES};
use restir_host::technique::{Repeats, Technique};
use restir_host::wgpu;
use restir_shared::camera::camera_ray;
use restir_shared::geometry::{PackedHit, Ray};
use restir_shared::glam::{DVec3, Vec3};
use restir_shared::layout::FilmPixel;
use restir_shared::rng::{Rng, Sampler};
use restir_shared::scene::{Surface, Trace};
use restir_tests::device;
use restir_tests::scenes::named;
use restir_tests::suite::{Trial, ensure};
use restir_tests::technique::Trials;
use restir_tests::technique::restir_di::settings;
use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};

pub(super) const SIZE: [u32; 2] = [18, 12];
/// Of the long session.
const FRAMES: u32 = 64;
const RESIZED_AT: u32 = 20;
const RESIZED: [u32; 2] = [13, 17];
const CUT_AT: u32 = 33;
const PAINTED_AT: u32 = 45;
const REBUILT_AT: u32 = 52;
/// Frames after which memory is looked at.
const WARM: u32 = 10;
const MANY: u32 = 1000;

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials = vec![
        Trial::test("frames are those of a render", frames_are_those_of_a_render),
        Trial::test("a mean that goes on is that of a render, after each frame", means_are_those_of_renders),
        Trial::test("what resets the history makes a fresh session", resets_make_fresh_sessions),
        Trial::test("what the camera sees can be given", primary_hits_can_be_given),
        Trial::test("hits are of known triangles", hits_are_of_known_triangles),
        Trial::test("what is refused leaves the session as it was", refusals_change_nothing),
        Trial::test("an edit may change nothing", an_edit_may_change_nothing),
        Trial::test("only what changed is uploaded", uploads_are_what_changed),
    ];
    trials.extend(device::trials(|adapter| {
        vec![
            adapter.trial("the bits of the CPU, whatever happens", same_on_device),
            adapter.trial("three frames in one submission", three_frames_in_one_submission),
            adapter.trial("primary hits that are given", primary_hits_on_device),
            adapter.trial("a frame that is thrown away", dropped_frames_are_forgotten),
            adapter.trial("as a texture", as_a_texture),
            adapter.trial(&format!("memory after {MANY} frames"), memory_stays),
            adapter.trial("what does not fit is named", what_does_not_fit_is_named),
            adapter.trial("without passthrough fast is had by name", without_passthrough),
        ]
    }));
    trials
}

/// A session with its image.
trait Player {
    fn frame(&mut self, view: &View<'_>) -> Result<Begun, Failed>;
    fn image(&mut self) -> Result<Vec<FilmPixel>, Failed>;
    fn resize(&mut self, size: [u32; 2]) -> Result<(), Failed>;
    fn reset(&mut self);
}

impl Player for CpuSession {
    fn frame(&mut self, view: &View<'_>) -> Result<Begun, Failed> {
        Ok(CpuSession::frame(self, view)?)
    }

    fn image(&mut self) -> Result<Vec<FilmPixel>, Failed> {
        Ok(CpuSession::pixels(self).to_vec())
    }

    fn resize(&mut self, size: [u32; 2]) -> Result<(), Failed> {
        Ok(CpuSession::resize(self, size)?)
    }

    fn reset(&mut self) {
        CpuSession::reset(self);
    }
}

/// A session on a device, whose frames are submitted one by one.
pub(super) struct OnDevice {
    pub(super) session: GpuSession,
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
}

impl OnDevice {
    pub(super) fn new(executor: &GpuExecutor, setup: Setup) -> Result<Self, Error> {
        Self::with_device(executor.device().clone(), executor.queue().clone(), Flavour::Exact, setup)
    }

    fn with_device(device: wgpu::Device, queue: wgpu::Queue, flavour: Flavour, setup: Setup) -> Result<Self, Error> {
        let pipelines = Pipelines::new(&device, flavour, Shaders::Embedded);
        Ok(Self { session: GpuSession::new(&device, pipelines, setup)?, device, queue })
    }

    /// Submits what `record` records, and waits.
    fn submit<T>(
        &mut self,
        record: impl FnOnce(&mut GpuSession, &mut wgpu::CommandEncoder) -> Result<T, Error>,
    ) -> Result<T, Failed> {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let recorded = record(&mut self.session, &mut encoder)?;
        self.queue.submit([encoder.finish()]);
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(recorded)
    }

    fn read(&self, buffer: &wgpu::Buffer) -> Result<Vec<u8>, Failed> {
        super::deferred::read(&self.device, &self.queue, buffer)
    }
}

impl Player for OnDevice {
    fn frame(&mut self, view: &View<'_>) -> Result<Begun, Failed> {
        self.submit(|session, encoder| session.frame(encoder, view))
    }

    fn image(&mut self) -> Result<Vec<FilmPixel>, Failed> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(self.session.output())?))
    }

    fn resize(&mut self, size: [u32; 2]) -> Result<(), Failed> {
        Ok(self.session.resize(size)?)
    }

    fn reset(&mut self) {
        self.session.reset();
    }
}

fn cpu() -> Result<CpuExecutor, Error> {
    CpuExecutor::new()
}

/// Techniques, with what may happen in a frame.
pub(super) fn techniques() -> Vec<(&'static str, Box<dyn Technique>)> {
    let with = |name, text| Trials::of(name).and_then(|trials| trials.with(text)).expect("the harness knows them");
    let direct = |text| with("restir-di", text);
    let paths = |text| with("restir-pt", text);
    vec![
        ("path", with("path", "max_depth=3")),
        ("restir-di", direct("")),
        ("quality", direct("preset=quality")),
        ("spatial reuse without feedback, tiles", direct("spatial=2,feedback=off,tiles=4x32")),
        ("without reuse in time", direct("temporal=off,spatial=1")),
        ("restir-pt", paths("")),
        ("restir-pt, hybrid, paths of paths", paths("shift=hybrid,spatial=2,feedback=on")),
        ("restir-pt, direct light by restir-di", paths("direct=restir-di")),
    ]
}

/// What is played for long: the scene, a name, the technique, and whether it is denoised.
type Play = (&'static str, &'static str, Box<dyn Technique>, Option<Denoise>);

/// The techniques, paths through bodies that scatter light and move, and frames that are denoised.
fn plays() -> Vec<Play> {
    let media = [Subsurface::Walk, Subsurface::Hybrid, Subsurface::Diffusion].map(|subsurface| {
        let settings = PathSettings { max_depth: 4, longest_walk: 70, subsurface, ..PathSettings::default() };
        ("moving-media", subsurface.name(), settings.into(), None)
    });
    let moving = techniques().into_iter().map(|(name, technique)| ("moving", name, technique, None));
    let denoised = ["moving", "moving-media"].map(|scene| {
        let settings = PathSettings { subsurface: Subsurface::Diffusion, ..PathSettings::default() };
        (scene, "denoised", settings.into(), Some(Denoise::default()))
    });
    moving.chain(media).chain(denoised).collect()
}

pub(super) fn camera(frame: u32) -> Camera {
    // it rests from time to time
    let along = f64::from(frame / 3 * 3) / f64::from(FRAMES);
    let position = DVec3::new(-0.6 + 1.3 * along, 0.3 - 0.5 * along, 3.6 - 0.4 * along);
    Camera::pinhole(position, DVec3::new(0.1 * along, 0.0, 0.0), DVec3::Y, 0.7)
}

pub(super) fn source(name: &str) -> Result<Scene, Error> {
    named(name).map_or_else(|| Scene::load(name), Ok)
}

/// What an editor has made of a scene by some frame: objects and lights move, later on a wall is painted, and then an object is gone.
fn edited(scene: &Scene, frame: u32) -> Scene {
    let mut scene = scene.at(f64::from(frame / 2));
    if frame >= PAINTED_AT {
        scene.materials[0].base_color = [0.1, 0.3, 0.7];
    }
    if frame >= REBUILT_AT {
        scene.instances.pop();
    }
    scene
}

fn ensure_same(what: &str, [a, b]: [&[FilmPixel]; 2]) -> Result<(), Failed> {
    let differing = a.iter().zip(b).filter(|(a, b)| bytemuck::bytes_of(*a) != bytemuck::bytes_of(*b)).count();
    ensure(a.len() == b.len() && differing == 0, || {
        format!("{what}: {differing} pixels of {} differ (the other has {})", a.len(), b.len())
    })
}

fn ensure_image(what: &str, image: &Image, pixels: &[FilmPixel]) -> Result<(), Failed> {
    let same = image.pixels.iter().zip(pixels).all(|(a, b)| a.map(f32::to_bits) == b.sum.map(f32::to_bits));
    ensure(same && image.pixels.len() == pixels.len(), || format!("{what} is another picture than the render's"))
}

/// Still and animated scenes, with a camera that moves and rests.
fn frames_are_those_of_a_render() -> Result<(), Failed> {
    const COUNT: u32 = 7;
    for (scene, (name, technique)) in
        ["moving", "cornell"].into_iter().flat_map(|scene| techniques().into_iter().map(move |t| (scene, t)))
    {
        let buffers = SceneBuffers::build(&source(scene)?)?;
        let of_samples = technique.about().repeats == Repeats::Samples;
        // samples are counted from the beginning of a mean, here that of each frame
        let mean_of = of_samples.then_some(1);
        let setup = Setup { seed: 3, mean_of, ..Setup::new(buffers.clone(), technique.clone(), SIZE) };
        let mut session = CpuSession::new(setup, cpu()?)?;
        for frame in 0..COUNT {
            let change = SceneChange::Frame(f64::from(frame));
            let begun = session.frame(&View { camera: Some(camera(frame)), scene: change, ..View::default() })?;
            ensure(begun.history == if frame == 0 { History::New } else { History::Kept }, || format!("{begun:?}"))?;
            let cameras = (0..=frame).map(camera).collect();
            let whole = Render { seed: 3, cameras, ..Render::new(SIZE, technique.clone()) };
            // and they are of a moment
            let (moment, whole) = if of_samples {
                (buffers.at(f64::from(frame))?, Render { cameras: vec![camera(frame)], ..whole })
            } else {
                (buffers.clone(), Render { count: frame + 1, ..whole })
            };
            let image = whole.render(&moment, &mut cpu()?)?.image;
            ensure_image(&format!("{scene}, {name}, frame {frame}"), &image, session.pixels())?;
        }
    }
    Ok(())
}

fn means_are_those_of_renders() -> Result<(), Failed> {
    let buffers = SceneBuffers::build(&source("cornell")?)?;
    for (name, technique) in techniques() {
        for samples in [1, 3] {
            let takes_samples = technique.about().repeats == Repeats::Samples;
            if samples > 1 && !takes_samples {
                continue;
            }
            let setup = Setup { samples, mean_of: Some(11), ..Setup::new(buffers.clone(), technique.clone(), SIZE) };
            let mut session = CpuSession::new(setup, cpu()?)?;
            // the mean begins anew where the view changes, and where it is full
            for (at, count) in (1..=9).chain(1..=4).enumerate() {
                let moved = Camera { position: buffers.camera.position * 1.01, ..buffers.camera };
                let camera = if at < 9 { buffers.camera } else { moved };
                session.frame(&View { camera: Some(camera), ..View::default() })?;
                let whole = Render {
                    count: count * samples,
                    accumulate: true,
                    cameras: vec![camera],
                    ..Render::new(SIZE, technique.clone())
                };
                // of chains, the mean after a change is that of later frames
                if takes_samples || at < 9 {
                    let image = whole.render(&buffers, &mut cpu()?)?.image;
                    ensure_image(&format!("{name}, mean of {count} x {samples}"), &image, session.pixels())?;
                }
            }
        }
    }
    Ok(())
}

/// Plays the long session; `see` gets each frame with what it reports.
fn play(
    player: &mut dyn Player,
    scene: &Scene,
    mut see: impl FnMut(u32, &View<'_>, Begun, Vec<FilmPixel>) -> Result<(), Failed>,
) -> Result<(), Failed> {
    for frame in 0..FRAMES {
        if frame == RESIZED_AT {
            player.resize(RESIZED)?;
        }
        if frame == CUT_AT {
            player.reset();
        }
        let scene = edited(scene, frame);
        let scene = if frame % 2 == 1 { SceneChange::None } else { SceneChange::Edited(&scene) };
        let view = View { camera: Some(camera(frame)), scene, ..View::default() };
        let begun = player.frame(&view)?;
        see(frame, &view, begun, player.image()?)?;
    }
    Ok(())
}

fn editable(scene: &Scene) -> Result<SceneBuffers, Error> {
    SceneBuffers::build_editable(&scene.at(0.0))
}

fn resets_make_fresh_sessions() -> Result<(), Failed> {
    for (scene, name, technique, denoise) in plays() {
        let scene = source(scene)?;
        let setup = |there, size| Setup { denoise: denoise.clone(), ..Setup::new(there, technique.clone(), size) };
        let mut session = CpuSession::new(setup(editable(&scene)?, SIZE), cpu()?)?;
        let mut fresh: Option<CpuSession> = None;
        let mut reset_at = Vec::new();
        play(&mut session, &scene, |frame, view, begun, pixels| {
            let now = edited(&scene, frame / 2 * 2);
            let mut view = view.clone();
            if begun.history != History::Kept {
                let size = if frame < RESIZED_AT { SIZE } else { RESIZED };
                // the tree is that of the scene as it was built
                let there = if frame < REBUILT_AT { editable(&scene) } else { SceneBuffers::build_editable(&now) }?;
                fresh = Some(CpuSession::new(setup(there, size), cpu()?)?);
                view.scene = SceneChange::Edited(&now);
                reset_at.push(frame);
            }
            let Some(fresh) = &mut fresh else { return Err("the first frame has a history".into()) };
            fresh.frame(&view)?;
            ensure_same(&format!("{name}, frame {frame}"), [&pixels, fresh.pixels()])
        })?;
        ensure(reset_at == [0, RESIZED_AT, CUT_AT, REBUILT_AT], || format!("{name}: history began at {reset_at:?}"))?;
    }
    Ok(())
}

fn same_on_device(executor: &mut GpuExecutor) -> Result<(), Failed> {
    for (scene, name, technique, denoise) in plays() {
        let scene = source(scene)?;
        let setup = Setup { denoise, ..Setup::new(editable(&scene)?, technique, SIZE) };
        let mut host = Vec::new();
        play(&mut CpuSession::new(setup.clone(), cpu()?)?, &scene, |_, _, begun, pixels| {
            host.push((begun, pixels));
            Ok(())
        })?;
        play(&mut OnDevice::new(executor, setup)?, &scene, |frame, _, begun, pixels| {
            let (host_begun, host_pixels) = &host[frame as usize];
            ensure(begun == *host_begun, || format!("{name}, frame {frame}: {begun:?} instead of {host_begun:?}"))?;
            ensure_same(&format!("{name}, frame {frame}"), [&pixels, host_pixels])
        })?;
    }
    Ok(())
}

fn three_frames_in_one_submission(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let scene = source("moving")?;
    let setup = Setup::new(editable(&scene)?, settings("preset=quality"), SIZE);
    let mut one_by_one = OnDevice::new(executor, setup.clone())?;
    let mut together = OnDevice::new(executor, setup)?;
    let moments: Vec<Scene> = (0..6).map(|frame| scene.at(f64::from(frame))).collect();
    let view = |frame: usize| View {
        camera: Some(camera(frame as u32)),
        scene: SceneChange::Edited(&moments[frame]),
        ..View::default()
    };
    for first in [0, 3] {
        together.submit(|session, encoder| {
            (first..first + 3).try_for_each(|at| session.frame(encoder, &view(at)).map(drop))
        })?;
        (first..first + 3).try_for_each(|at| one_by_one.frame(&view(at)).map(drop))?;
        ensure_same("three frames", [&together.image()?, &one_by_one.image()?])?;
    }
    Ok(())
}

/// A frame that is recorded and thrown away has not written what it brought: after a reset nothing is missed.
fn dropped_frames_are_forgotten(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let scene = source("moving")?;
    let setup = Setup::new(editable(&scene)?, settings("preset=quality"), SIZE);
    let moments: Vec<Scene> = (0..6).map(|frame| scene.at(f64::from(frame))).collect();
    let view = |frame: usize| View { scene: SceneChange::Edited(&moments[frame]), ..View::default() };
    let mut player = OnDevice::new(executor, setup.clone())?;
    (0..2).try_for_each(|frame| player.frame(&view(frame)).map(drop))?;
    let mut encoder = player.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    player.session.frame(&mut encoder, &view(2))?;
    drop(encoder);
    player.reset();
    let mut fresh = CpuSession::new(setup, cpu()?)?;
    for frame in 2..6 {
        player.frame(&view(frame))?;
        fresh.frame(&view(frame))?;
        ensure_same(&format!("frame {frame}"), [&player.image()?, fresh.pixels()])?;
    }
    Ok(())
}

/// Rows that a copy can take at once, and others.
fn as_a_texture(executor: &mut GpuExecutor) -> Result<(), Failed> {
    for size in [[16, 9], [18, 12]] {
        let scene = SceneBuffers::build(&source("cornell")?)?;
        let mut player = OnDevice::new(executor, Setup::new(scene, settings(""), size))?;
        let describe = |format, [width, height]: [u32; 2]| wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        };
        let texture = |format, size| player.device.create_texture(&describe(format, size));
        let right = texture(wgpu::TextureFormat::Rgba32Float, size);
        let wrong =
            [texture(wgpu::TextureFormat::Rgba32Float, [8, 8]), texture(wgpu::TextureFormat::Rgba16Float, size)];
        let row_bytes = (size[0] * 16).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let copy = player.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row_bytes * size[1]),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        player.submit(|session, encoder| {
            session.frame(encoder, &View::default())?;
            for texture in &wrong {
                let refused =
                    session.copy_to_texture(encoder, texture).is_err_and(|e| e.to_string().contains("make one"));
                assert!(refused, "a texture of another kind is refused");
            }
            session.copy_to_texture(encoder, &right)?;
            let layout =
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row_bytes), rows_per_image: None };
            encoder.copy_texture_to_buffer(
                right.as_image_copy(),
                wgpu::TexelCopyBufferInfo { buffer: &copy, layout },
                right.size(),
            );
            Ok(())
        })?;
        let bytes = player.read(&copy)?;
        let rows = bytes.chunks_exact(row_bytes as usize).flat_map(|row| &row[..(size[0] * 16) as usize]);
        let texels: Vec<FilmPixel> = bytemuck::pod_collect_to_vec(&rows.copied().collect::<Vec<u8>>());
        ensure_same(&format!("{size:?}"), [&texels, &player.image()?])?;
    }
    Ok(())
}

/// A mean that goes on and everything that moves: the session's buffers, to the byte. That the process does not grow is measured by
/// `cargo lab session`, where no other test runs beside.
fn memory_stays(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let scene = source("moving")?;
    let setup = Setup { mean_of: Some(4096), ..Setup::new(editable(&scene)?, settings("preset=quality"), [8, 6]) };
    let mut player = OnDevice::new(executor, setup)?;
    let moments: Vec<Scene> = (0..8).map(|frame| scene.at(f64::from(frame))).collect();
    let mut bytes = Vec::new();
    for frame in 0..MANY {
        let scene = SceneChange::Edited(&moments[frame as usize % moments.len()]);
        player.frame(&View { camera: Some(camera(frame % FRAMES)), scene, ..View::default() })?;
        bytes.push(player.session.bytes());
    }
    let [warm, last] = [WARM, MANY - 1].map(|frame| bytes[frame as usize]);
    ensure(warm == last, || format!("{warm} bytes after {WARM} frames, {last} after {MANY}"))
}

fn what_does_not_fit_is_named(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let limit = executor.device().limits().max_storage_buffer_binding_size;
    let side = 1 << 14;
    let scene = SceneBuffers::build(&source("cornell")?)?;
    let setup = |size| Setup::new(scene.clone(), settings("preset=quality"), size);
    // points of 48 bytes a pixel are the largest plane
    if 48 * u64::from(side) * u64::from(side) > limit {
        let refused =
            OnDevice::new(executor, setup([side; 2])).err().map(|error| error.to_string()).unwrap_or_default();
        println!("{refused}");
        let bytes = 48 * u64::from(side) * u64::from(side);
        let named = ["\"points\"".to_owned(), format!("{bytes} bytes"), format!("{limit} bytes")];
        ensure(named.iter().all(|word| refused.contains(word)), || refused.clone())?;
        let mut player = OnDevice::new(executor, setup(SIZE))?;
        player.frame(&View::default())?;
        let before = player.image()?;
        ensure(player.resize([side; 2]).is_err(), || "what does not fit at first fits later".to_owned())?;
        ensure_same("after what was refused", [&player.image()?, &before])?;
        player.frame(&View::default())?;
    }
    Ok(())
}

/// What wgpu answers, which it does at once outside of browsers.
fn answer<T>(future: impl Future<Output = T>) -> Result<T, Failed> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(answer) => Ok(answer),
        Poll::Pending => Err("wgpu has something to wait for".into()),
    }
}

/// On a device that was opened without the feature that loads modules as they are, `exact` is refused by a sentence that names `fast`, which
/// then gives a picture.
fn without_passthrough(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let name = executor.device().adapter_info().name;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = answer(instance.enumerate_adapters(wgpu::Backends::PRIMARY))?;
    let adapter = adapters.into_iter().find(|adapter| adapter.get_info().name == name).ok_or("it has gone")?;
    let descriptor = wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..wgpu::DeviceDescriptor::default() };
    let (device, queue) = answer(adapter.request_device(&descriptor))??;
    let setup = Setup::new(SceneBuffers::build(&source("cornell")?)?, settings(""), SIZE);
    let mut unfit = GpuExecutor::with_device(device.clone(), queue.clone(), Flavour::Exact, Shaders::Embedded);
    let session = OnDevice::with_device(device.clone(), queue.clone(), Flavour::Exact, setup.clone());
    for refused in [unfit.check().err(), session.err()] {
        let said = refused.map_or_else(|| "exact is taken".to_owned(), |error| error.to_string());
        ensure(said.contains("PASSTHROUGH_SHADERS") && said.contains("fast"), || said.clone())?;
    }
    let mut fast = OnDevice::with_device(device, queue, Flavour::Fast, setup)?;
    fast.frame(&View::default())?;
    ensure(fast.image()?.iter().any(|pixel| pixel.sum[1] > 0.0), || "fast shows nothing".to_owned())
}

/// What a rasteriser would write: for each pixel the triangle, the coordinates and the distance of the nearest hit.
fn visibility_buffer(buffers: &SceneBuffers, camera: Camera) -> Vec<PackedHit> {
    let (traced, params) = (buffers.traced_view(), camera.params(SIZE[0], SIZE[1]));
    let hit = |pixel: u32| {
        let (x, y) = (pixel % SIZE[0], pixel / SIZE[0]);
        let rng = Rng::new(x, y, 0, 0, Sampler::Sobol);
        traced.closest(&camera_ray(&params, false, |point| point, buffers.features, &rng, x, y))
    };
    (0..SIZE[0] * SIZE[1]).map(|pixel| PackedHit::pack(&hit(pixel))).collect()
}

fn primary_hits_can_be_given() -> Result<(), Failed> {
    let scene = source("moving")?;
    let setup = Setup::new(editable(&scene)?, settings("preset=quality"), SIZE);
    let mut own = CpuSession::new(setup.clone(), cpu()?)?;
    let mut given = CpuSession::new(setup.clone(), cpu()?)?;
    for frame in 0..4 {
        let moment = scene.at(f64::from(frame));
        let view = View { camera: Some(camera(frame)), scene: SceneChange::Edited(&moment), ..View::default() };
        let found = own.frame(&view)?;
        let plane = given.primary_mut().ok_or("ReSTIR DI has a plane of hits")?;
        plane.copy_from_slice(&visibility_buffer(&setup.scene.refit(&moment)?, camera(frame)));
        let begun = given.frame(&View { primary_given: true, ..view })?;
        ensure(begun.passes + 1 == found.passes, || format!("{} passes instead of {}", begun.passes, found.passes))?;
        ensure_same(&format!("frame {frame}"), [own.pixels(), given.pixels()])?;
    }
    let mut paths = CpuSession::new(Setup { technique: PathSettings::default().into(), ..setup }, cpu()?)?;
    ensure(paths.primary_mut().is_none(), || "path tracing has no plane of hits".to_owned())?;
    let refused = paths.frame(&View { primary_given: true, ..View::default() });
    ensure(refused.is_err_and(|error| error.to_string().contains("primary hits")), || "not refused".to_owned())
}

fn primary_hits_on_device(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let scene = source("moving")?;
    let setup = Setup::new(editable(&scene)?, settings("preset=quality"), SIZE);
    let mut host = CpuSession::new(setup.clone(), cpu()?)?;
    let mut player = OnDevice::new(executor, setup.clone())?;
    for frame in 0..4 {
        let moment = scene.at(f64::from(frame));
        let hits = visibility_buffer(&setup.scene.refit(&moment)?, camera(frame));
        let plane = player.session.primary().ok_or("ReSTIR DI has a plane of hits")?;
        player.queue.write_buffer(plane, 0, bytemuck::cast_slice(&hits));
        let view = View { camera: Some(camera(frame)), scene: SceneChange::Edited(&moment), ..View::default() };
        host.frame(&view)?;
        player.frame(&View { primary_given: true, ..view })?;
        ensure_same(&format!("frame {frame}"), [host.pixels(), &player.image()?])?;
    }
    Ok(())
}

/// The id and the coordinates of a hit say which triangle of which mesh is hit, and where.
fn hits_are_of_known_triangles() -> Result<(), Failed> {
    let scene = source("moving")?.at(3.0);
    let buffers = SceneBuffers::build_editable(&scene)?;
    let places = buffers.triangle_ids().ok_or("it can be edited")?;
    ensure(places.len() as u64 == buffers.stats().triangles, || "a triangle is missing".to_owned())?;
    let mut hits = 0;
    for hit in visibility_buffer(&buffers, camera(0)).into_iter().map(PackedHit::unpack).filter(|hit| hit.is_hit()) {
        let [instance, index] = places[hit.id as usize].map(|i| i as usize);
        let instance = &scene.instances[instance];
        let mesh = &scene.meshes[instance.mesh];
        let corners = mesh.indices[index].map(|i| DVec3::from_array(mesh.positions[i as usize].map(f64::from)));
        let [a, mut b, mut c] = corners.map(|corner| instance.transform.transform_point3(corner));
        if instance.transform.matrix3.determinant() < 0.0 {
            (b, c) = (c, b);
        }
        let (u, v) = (f64::from(hit.uv.x), f64::from(hit.uv.y));
        let there = a + (b - a) * u + (c - a) * v;
        let ray = Ray { origin: Vec3::ZERO, direction: Vec3::X, t_max: Ray::FAR, key: 0 };
        let off = (buffers.view().surface(&ray, &hit).position.as_dvec3() - there).length();
        ensure(off < 1e-5, || format!("triangle {index} is {off:e} away"))?;
        hits += 1;
    }
    ensure(hits > 100, || format!("only {hits} pixels see anything"))?;
    let still = SceneBuffers::build(&source("cornell")?)?;
    ensure(still.triangle_ids().is_none(), || "nothing is kept of a scene that stands still".to_owned())
}

fn refusals_change_nothing() -> Result<(), Failed> {
    let scene = source("moving")?;
    let setup = Setup::new(editable(&scene)?, settings(""), SIZE);
    let [mut session, mut spared] = [CpuSession::new(setup.clone(), cpu()?)?, CpuSession::new(setup.clone(), cpu()?)?];
    let view = View::default();
    session.frame(&view)?;
    spared.frame(&view)?;
    let mut broken = scene.at(1.0);
    Arc::make_mut(&mut broken.meshes[0]).positions[0][1] = f32::NAN;
    let mut dark = scene.at(1.0);
    dark.lights[0].intensity = [-1.0; 3];
    for wrong in [&broken, &dark] {
        let refused = session.frame(&View { scene: SceneChange::Edited(wrong), ..View::default() });
        ensure(matches!(refused, Err(Error::Scene { .. })), || format!("{refused:?}"))?;
    }
    let mut lost = scene.at(1.0);
    lost.instances[0].transform.translation.x = f64::NAN;
    let nowhere = Camera { position: camera(0).target, ..camera(0) };
    let views = [
        View { scene: SceneChange::Edited(&lost), ..View::default() },
        View { camera: Some(nowhere), ..View::default() },
        View { scene: SceneChange::Frame(f64::NAN), ..View::default() },
        View { scene: SceneChange::Frame(f64::INFINITY), ..View::default() },
        View { camera: Some(Camera { lens_radius: 0.1, ..camera(0) }), primary_given: true, ..View::default() },
    ];
    for wrong in &views {
        ensure(session.frame(wrong).is_err(), || format!("{wrong:?} is a view"))?;
    }
    for size in [[0, 4], [4, 1 << 20]] {
        ensure(session.resize(size).is_err(), || format!("{size:?} is a size"))?;
    }
    ensure(
        session.set_technique(DiSettings { candidates: MAX_CANDIDATES + 1, ..DiSettings::default() }).is_err(),
        || "more candidates than there may be".to_owned(),
    )?;
    session.frame(&view)?;
    spared.frame(&view)?;
    ensure_same("after refusals", [session.pixels(), spared.pixels()])?;
    for (samples, mean_of) in [(0, None), (1, Some(0)), (1 << 20, Some(1 << 20))] {
        let refused = CpuSession::new(Setup { samples, mean_of, ..setup.clone() }, cpu()?);
        ensure(refused.is_err(), || format!("{samples} samples, mean of {mean_of:?}"))?;
    }
    Ok(())
}

/// A mean goes on while the same scene is given as edited, and other alpha modes are built anew.
fn an_edit_may_change_nothing() -> Result<(), Failed> {
    let scene = source("moving")?.at(2.0);
    let setup = Setup { mean_of: Some(64), ..Setup::new(SceneBuffers::build_editable(&scene)?, settings(""), SIZE) };
    let [mut told, mut left] = [CpuSession::new(setup.clone(), cpu()?)?, CpuSession::new(setup, cpu()?)?];
    for frame in 0..5 {
        let begun = told.frame(&View { scene: SceneChange::Edited(&scene), ..View::default() })?;
        left.frame(&View::default())?;
        ensure(frame == 0 || begun.uploaded == 0, || format!("frame {frame}: {begun:?}"))?;
        ensure_same(&format!("frame {frame}"), [told.pixels(), left.pixels()])?;
    }
    let mut masked = scene.clone();
    masked.materials[0].alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
    let begun = told.frame(&View { scene: SceneChange::Edited(&masked), ..View::default() })?;
    ensure(begun.history == History::Lost("the alpha modes of its materials"), || format!("{begun:?}"))
}

/// Of an object that moves its triangles, the boxes over them, and nothing where all stands still.
fn uploads_are_what_changed() -> Result<(), Failed> {
    let scene = source("toys")?;
    let buffers = SceneBuffers::build_editable(&scene.at(0.0))?;
    let whole = buffers.stats().bytes;
    let mut session = CpuSession::new(Setup::new(buffers, settings(""), SIZE), cpu()?)?;
    let mut moved = scene.at(0.0);
    let mut uploaded = Vec::new();
    for frame in 0..8 {
        let last = moved.instances.len() - 1;
        moved.instances[last].transform.translation.x += 0.01;
        let change = if frame < 5 { SceneChange::Edited(&moved) } else { SceneChange::None };
        uploaded.push(session.frame(&View { scene: change, ..View::default() })?.uploaded);
    }
    println!("{whole} bytes of arenas, uploaded {uploaded:?}");
    ensure(uploaded[0] > 0 && uploaded[5..] == [0; 3], || format!("{uploaded:?}"))?;
    ensure(uploaded[2..5].iter().all(|&bytes| bytes > 0 && bytes < uploaded[0] / 4), || format!("{uploaded:?}"))
}
