//! Whole renders: the same bits for every number of threads, split into dispatches, and on every adapter.

use libtest_mimic::Failed;
use restir_host::Shaders;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor, Flavour, GpuExecutor};
use restir_host::metrics::compare;
use restir_host::render::{Render, Rendered};
use restir_host::scene::{Camera, Environment, Scene, builtin};
use restir_host::technique::path::PathSettings;
use restir_host::wgpu::Features;
use restir_kernels::Case;
use restir_kernels::path::path;
use restir_shared::film::MAX_BLOCK_LOG2;
use restir_shared::technique::path::{PathFlags, PathParams};
use restir_tests::data;
use restir_tests::device::{self, Adapter, is_llvmpipe};
use restir_tests::scenes::path_params;
use restir_tests::suite::{Trial, ensure};
use restir_tests::{gltf_files, parity};
use std::sync::mpsc;

/// Most samples of a pixel in a dispatch.
const SPLITS: [Option<u32>; 6] = [Some(1), Some(2), Some(3), Some(5), Some(64), None];
/// The same where the scene is what matters.
const FEW_SPLITS: [Option<u32>; 2] = [Some(1), None];
const THREADS: [usize; 3] = [1, 2, 3];
/// Of all surfaces where blocks are to take long.
const REFLECTANCE: f32 = 0.99;

/// A render.
#[derive(Clone, Copy)]
struct Frame {
    subject: Subject,
    size: [u32; 2],
    samples: u32,
    seed: u32,
    jitter: bool,
    roulette: bool,
    splits: &'static [Option<u32>],
}

/// What is rendered.
#[derive(Clone, Copy)]
enum Subject {
    /// A built-in scene.
    Builtin(&'static str),
    /// A built-in scene through a lens.
    Lens(&'static str),
    /// A file in the folder of meshes, under the default light.
    Mesh(&'static str),
    /// The same under an environment from that folder.
    Outdoors(&'static str),
    /// A generated glTF file with textures, under the default light.
    Textured(&'static str),
}

use Subject::{Builtin, Lens, Mesh, Outdoors, Textured};

const fn frame(subject: Subject, size: [u32; 2], samples: u32, seed: u32) -> Frame {
    Frame { subject, size, samples, seed, jitter: false, roulette: false, splits: &SPLITS }
}

impl Frame {
    const fn jittered(self) -> Self {
        Self { jitter: true, ..self }
    }

    const fn with_roulette(self) -> Self {
        Self { roulette: true, ..self }
    }
}

const FRAMES: [Frame; 17] = [
    frame(Builtin("cornell"), [33, 17], 1, 0),
    frame(Builtin("cornell"), [33, 17], 7, 1).jittered(),
    frame(Builtin("cornell"), [1, 1], 7, 2).jittered(),
    frame(Builtin("cornell"), [50, 3], 7, u32::MAX).jittered().with_roulette(),
    frame(Builtin("cornell-mitsuba"), [33, 17], 7, 3).with_roulette(),
    frame(Builtin("cornell-mitsuba"), [3, 50], 1, 4),
    frame(Builtin("furnace"), [33, 17], 7, 5).jittered(),
    frame(Builtin("furnace"), [1, 1], 1, 6),
    frame(Builtin("furnace"), [50, 3], 7, 7).with_roulette(),
    frame(Builtin("cornell"), [8, 8], 128, 13),
    frame(Lens("cornell-mixed"), [33, 17], 7, 15).jittered(),
    frame(Mesh("dragon_res3.glb"), [33, 17], 1, 8),
    frame(Mesh("dragon_res3.glb"), [17, 9], 64, 14),
    frame(Mesh("dragon_res3.glb"), [41, 29], 7, 9).jittered().with_roulette(),
    frame(Mesh("bunny.glb"), [33, 17], 7, 10).jittered(),
    frame(Mesh("bunny.glb"), [50, 3], 1, 11),
    frame(Mesh("suzanne.glb"), [33, 17], 7, 12).with_roulette(),
];

const ENVIRONMENT: &str = "studio.exr";
const MESHES: [&str; 4] = ["bunny.glb", "dragon_res2.glb", "dragon_res3.glb", "suzanne.glb"];

/// [`FRAMES`], and every built-in scene, every mesh outdoors, and every generated file.
fn frames() -> Vec<Frame> {
    let builtin = builtin::NAMES.iter().map(|(name, _)| Builtin(name));
    let meshes = MESHES.into_iter().map(Outdoors);
    let files = gltf_files::textured().into_iter().map(|(name, _)| Textured(name));
    let few = |(seed, subject)| Frame { splits: &FEW_SPLITS, ..frame(subject, [40, 24], 3, seed).jittered() };
    let more = (100..).zip(builtin.chain(meshes).chain(files)).map(few);
    FRAMES.into_iter().chain(more).collect()
}

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials: Vec<Trial> = frames().into_iter().map(cpu_trial).collect();
    trials.extend(device::trials(|adapter| {
        let cut = [("", PathFlags::NONE), (", with roulette", PathFlags::ROULETTE)].map(|(how, flags)| {
            let name = format!("blocks that the device cuts short are dropped and counted{how}");
            adapter.trial(&name, move |executor| cut_blocks_are_counted(executor, flags))
        });
        let kept = adapter.trial("pipelines are kept in a file, of which a damaged one is ignored", kept_pipelines);
        frames().into_iter().map(|frame| gpu_trial(adapter, frame)).chain(cut).chain([kept]).collect()
    }));
    trials
}

/// One block a pixel of paths that roulette hardly ends.
fn long_blocks(flags: PathFlags) -> Result<Case, Failed> {
    let mut scene = Scene::load("cornell")?;
    scene.materials.iter_mut().for_each(|material| material.base_color = [REFLECTANCE; 3]);
    let scene = SceneBuffers::build(&scene)?;
    let params = PathParams { block_log2: MAX_BLOCK_LOG2, flags, ..path_params(&scene, [8, 8], 64) };
    Ok(Case::new(&path::DESC, "long", 8, 8)
        .with(&[params])
        .with(&scene.geometry)
        .with(&scene.attributes)
        .with(&scene.texels)
        .output())
}

/// lavapipe (gallivm) ends the loops of an invocation after 65 535 rounds in all and reports nothing. Plans keep far below
/// that; a block that goes beyond must not pass as a result.
fn cut_blocks_are_counted(executor: &mut GpuExecutor, flags: PathFlags) -> Result<(), Failed> {
    let case = long_blocks(flags)?;
    let host = parity::run(&mut CpuExecutor::new()?, &case)?.concat();
    let device = parity::run(executor, &case)?.concat();
    let is_cut = |pixel: &&[u32]| f32::from_bits(pixel[3]) > 0.0;
    let wrong = host.chunks(4).zip(device.chunks(4)).filter(|(h, d)| h != d && !is_cut(d)).count();
    let cut = device.chunks(4).filter(is_cut).count();
    println!("{cut} of 64 blocks were cut{}", if cut == 0 { ": not triggered" } else { "" });
    ensure(wrong == 0, || format!("{wrong} blocks were cut and not counted"))?;
    ensure(cut > 0 || !is_llvmpipe(executor), || "no block was cut: nothing was shown".to_owned())
}

fn cpu_trial(frame: Frame) -> Trial {
    Trial::test(format!("{}: threads and dispatches", frame.name()), move || {
        let (buffers, reference) = frame.reference()?;
        THREADS.into_iter().try_for_each(|threads| {
            frame.is_same(&mut CpuExecutor::with_threads(threads)?, &format!("{threads} threads"), &buffers, &reference)
        })
    })
}

fn gpu_trial(adapter: &Adapter, frame: Frame) -> Trial {
    adapter.trial(&frame.name(), move |executor| {
        let (buffers, reference) = frame.reference()?;
        let loading = executor.loading();
        frame.is_same(executor, &loading, &buffers, &reference)
    })
}

impl Frame {
    fn name(&self) -> String {
        let [width, height] = self.size;
        let flag = |on, text| if on { text } else { "" };
        format!(
            "{}, {width}x{height}, {} spp, seed {}{}{}",
            self.subject.name(),
            self.samples,
            self.seed,
            flag(self.jitter, ", jitter"),
            flag(self.roulette, ", roulette")
        )
    }

    /// The scene, and its picture by one thread in as few dispatches as there can be, which shows something.
    fn reference(&self) -> Result<(SceneBuffers, Rendered), Failed> {
        let [width, height] = self.size.map(f64::from);
        let buffers = SceneBuffers::build(&self.subject.scene(width / height)?)?;
        let reference = self.render(&mut CpuExecutor::with_threads(1)?, &buffers, None)?;
        let pixels = &reference.image.pixels;
        let constant = pixels.len() > 1 && pixels.iter().all(|pixel| pixel == &pixels[0]);
        let black = pixels.as_flattened().iter().all(|&value| value == 0.0);
        ensure(!constant && !black, || "the picture is constant".to_owned())?;
        Ok((buffers, reference))
    }

    fn render(
        &self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        split: Option<u32>,
    ) -> Result<Rendered, Failed> {
        let &Self { jitter, roulette, samples, seed, size, .. } = self;
        let path = PathSettings { jitter, roulette, dispatch_samples: split, ..PathSettings::default() };
        let settings = Render { count: samples, seed, ..Render::new(size, path) };
        Ok(settings.render(scene, executor)?)
    }

    /// By every split.
    fn is_same(
        &self,
        executor: &mut dyn Executor,
        what: &str,
        buffers: &SceneBuffers,
        reference: &Rendered,
    ) -> Result<(), Failed> {
        self.splits.iter().try_for_each(|&split| {
            let rendered = self.render(executor, buffers, split)?;
            ensure_same(&format!("{what}, dispatches of {split:?}"), &rendered, reference)
        })
    }
}

impl Subject {
    fn name(self) -> String {
        match self {
            Builtin(name) | Mesh(name) => name.to_owned(),
            Lens(name) => format!("{name} through a lens"),
            Outdoors(name) => format!("{name} under {ENVIRONMENT}"),
            Textured(name) => format!("generated file {name}"),
        }
    }

    fn scene(self, aspect: f64) -> Result<Scene, Failed> {
        Ok(match self {
            Builtin(name) => Scene::load(name)?,
            Lens(name) => {
                let scene = Scene::load(name)?;
                let through = |camera| Camera { lens_radius: 0.1, focus_distance: Some(3.0), ..camera };
                Scene { camera: scene.camera.map(through), ..scene }
            }
            Mesh(name) => data::lit_mesh(name, aspect)?,
            Outdoors(name) => {
                let mut scene = data::mesh(name)?;
                scene.environment = Some(Environment::load(&data::path(ENVIRONMENT), &mut scene.warnings)?);
                scene
            }
            Textured(name) => textured(name)?,
        })
    }
}

/// As the program reads it.
fn textured(name: &str) -> Result<Scene, Failed> {
    let (_, bytes) = gltf_files::textured().into_iter().find(|(n, _)| *n == name).ok_or("no such file")?;
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("generated.glb");
    std::fs::write(&path, bytes)?;
    let mut scene = Scene::open(&path)?;
    if !scene.has_light() {
        scene.add_default_light();
    }
    Ok(scene)
}

fn kept_pipelines(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let frame = frame(Builtin("cornell"), [8, 8], 7, 16);
    let (buffers, reference) = frame.reference()?;
    let path = || std::fs::read_dir(folder.path())?.next().transpose().map(|file| file.map(|file| file.path()));
    let run = |what: &str| -> Result<(), Failed> {
        let (sender, seen) = mpsc::channel();
        let executor = executor.reload(Flavour::Exact, Shaders::Embedded).keep_pipelines_in(folder.path());
        let mut executor =
            executor.observe_pipelines(move |done, total| sender.send((done, total)).unwrap_or_default());
        ensure_same(what, &frame.render(&mut executor, &buffers, Some(1))?, &reference)?;
        let seen: Vec<_> = seen.try_iter().collect();
        ensure(seen == [(1, 3), (2, 3), (3, 3)], || format!("{what}: of path, film_add and film_resolve {seen:?}"))
    };
    run("no file")?;
    let Some(path) = path()? else {
        ensure(!executor.device().features().contains(Features::PIPELINE_CACHE), || "nothing was kept".to_owned())?;
        println!("the adapter gives no access to its cache");
        return Ok(());
    };
    let whole = std::fs::read(&path)?;
    let flipped = whole.iter().enumerate().map(|(i, byte)| byte ^ u8::from(i == whole.len() - 1)).collect();
    let files = [("whole", whole.clone()), ("empty", vec![]), ("cut", whole[..40].to_vec()), ("flipped", flipped)];
    for (what, bytes) in files {
        std::fs::write(&path, bytes)?;
        run(what)?;
        let written = std::fs::read(&path)?;
        let (hash, data) = written.split_at(32);
        ensure(blake3::hash(data).as_bytes() == hash, || format!("{what}: the file that was written is damaged"))?;
    }
    Ok(())
}

fn ensure_same(what: &str, rendered: &Rendered, reference: &Rendered) -> Result<(), Failed> {
    let comparison = compare(&rendered.image, &reference.image)?;
    ensure(comparison.identical, || {
        format!("{what}: {} words of the picture differ, max {} ulp", comparison.differing_words, comparison.max_ulp)
    })?;
    ensure(rendered.dropped_samples == reference.dropped_samples, || {
        format!("{what}: {} samples were dropped instead of {}", rendered.dropped_samples, reference.dropped_samples)
    })
}
