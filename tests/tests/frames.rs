//! Whole renders: the same bits for every number of threads, split into dispatches, and on every adapter.

use libtest_mimic::{Arguments, Failed, Trial};
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor, GpuExecutor};
use restir_host::metrics::compare;
use restir_host::render::{PathSettings, RenderSettings, Rendered, render};
use restir_host::scene::Scene;
use restir_kernels::{Case, path};
use restir_shared::film::MAX_BLOCK_LOG2;
use restir_shared::layout::{PATH_ROULETTE, PathParams};
use restir_tests::data;
use restir_tests::device::{self, Adapter, is_llvmpipe};
use restir_tests::parity;
use restir_tests::suite::ensure;
use std::ops::ControlFlow;
use std::process::ExitCode;

/// Most samples of a pixel in a dispatch.
const SPLITS: [Option<u32>; 6] = [Some(1), Some(2), Some(3), Some(5), Some(64), None];
const THREADS: [usize; 3] = [1, 2, 3];
/// Of all surfaces where blocks are to take long.
const REFLECTANCE: f32 = 0.99;

/// A picture.
#[derive(Clone, Copy)]
struct Frame {
    /// A built-in scene, or a file in the folder of meshes.
    scene: &'static str,
    size: [u32; 2],
    samples: u32,
    seed: u32,
    jitter: bool,
    roulette: bool,
}

const fn frame(scene: &'static str, size: [u32; 2], samples: u32, seed: u32) -> Frame {
    Frame { scene, size, samples, seed, jitter: false, roulette: false }
}

impl Frame {
    const fn jittered(self) -> Self {
        Self { jitter: true, ..self }
    }

    const fn with_roulette(self) -> Self {
        Self { roulette: true, ..self }
    }
}

const FRAMES: [Frame; 16] = [
    frame("cornell", [33, 17], 1, 0),
    frame("cornell", [33, 17], 7, 1).jittered(),
    frame("cornell", [1, 1], 7, 2).jittered(),
    frame("cornell", [50, 3], 7, u32::MAX).jittered().with_roulette(),
    frame("cornell-mitsuba", [33, 17], 7, 3).with_roulette(),
    frame("cornell-mitsuba", [3, 50], 1, 4),
    frame("furnace", [33, 17], 7, 5).jittered(),
    frame("furnace", [1, 1], 1, 6),
    frame("furnace", [50, 3], 7, 7).with_roulette(),
    frame("cornell", [8, 8], 128, 13),
    frame("dragon_res3.glb", [33, 17], 1, 8),
    frame("dragon_res3.glb", [17, 9], 64, 14),
    frame("dragon_res3.glb", [41, 29], 7, 9).jittered().with_roulette(),
    frame("bunny.glb", [33, 17], 7, 10).jittered(),
    frame("bunny.glb", [50, 3], 1, 11),
    frame("suzanne.glb", [33, 17], 7, 12).with_roulette(),
];

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let mut trials: Vec<Trial> = FRAMES.iter().map(cpu_trial).collect();
    trials.extend(device::trials("frames", |adapter| {
        let cut = [("", 0), (", with roulette", PATH_ROULETTE)].map(|(how, flags)| {
            let name = format!("blocks that the device cuts short are dropped and counted{how}");
            adapter.trial(&name, move |executor| cut_blocks_are_counted(executor, flags))
        });
        FRAMES.iter().map(|frame| gpu_trial(adapter, frame)).chain(cut).collect()
    }));
    libtest_mimic::run(&arguments, trials).exit_code()
}

/// One block a pixel of paths that roulette hardly ends.
fn long_blocks(flags: u32) -> Result<Case, Failed> {
    let mut scene = Scene::load("cornell")?;
    for material in &mut scene.materials {
        material.base_color = [REFLECTANCE; 3];
    }
    let scene = SceneBuffers::build(&scene)?;
    let params = PathParams {
        scene: scene.header,
        camera: scene.camera.params(8, 8),
        width: 8,
        height: 8,
        block_log2: MAX_BLOCK_LOG2,
        max_depth: 64,
        flags,
        ..PathParams::default()
    };
    Ok(Case::new("long", 8, 8)
        .with(&[params])
        .with(&scene.geometry)
        .with(&scene.attributes)
        .with(&scene.texels)
        .output())
}

/// lavapipe (gallivm) ends the loops of an invocation after 65 535 rounds in all and reports nothing. Plans keep far below
/// that; a block that goes beyond must not pass as a result.
fn cut_blocks_are_counted(executor: &mut GpuExecutor, flags: u32) -> Result<(), Failed> {
    let case = long_blocks(flags)?;
    let host = parity::run(&mut CpuExecutor::new(None)?, &path::DESC, &case)?.concat();
    let device = parity::run(executor, &path::DESC, &case)?.concat();
    let is_cut = |pixel: &&[u32]| f32::from_bits(pixel[3]) > 0.0;
    let wrong = host.chunks(4).zip(device.chunks(4)).filter(|(h, d)| h != d && !is_cut(d)).count();
    let cut = device.chunks(4).filter(is_cut).count();
    println!("{cut} of 64 blocks were cut{}", if cut == 0 { ": not triggered" } else { "" });
    ensure(wrong == 0, || format!("{wrong} blocks were cut and not counted"))?;
    ensure(cut > 0 || !is_llvmpipe(executor), || "no block was cut: nothing was shown".to_owned())
}

fn cpu_trial(frame: &'static Frame) -> Trial {
    let trial = Trial::test(format!("{}: threads and dispatches", frame.name()), || same_on_cpu(frame));
    frame.ignored_without_data(trial)
}

fn gpu_trial(adapter: &Adapter, frame: &'static Frame) -> Trial {
    frame.ignored_without_data(adapter.trial(&frame.name(), |executor| same_on_gpu(executor, frame)))
}

impl Frame {
    fn name(&self) -> String {
        let [width, height] = self.size;
        let flag = |on, text| if on { text } else { "" };
        format!(
            "{}, {width}x{height}, {} spp, seed {}{}{}",
            self.scene,
            self.samples,
            self.seed,
            flag(self.jitter, ", jitter"),
            flag(self.roulette, ", roulette")
        )
    }

    fn is_mesh(&self) -> bool {
        self.scene.ends_with(".glb")
    }

    fn ignored_without_data(&self, trial: Trial) -> Trial {
        if self.is_mesh() { data::trial(trial) } else { trial }
    }

    fn buffers(&self) -> Result<SceneBuffers, Failed> {
        let [width, height] = self.size.map(f64::from);
        let scene = if self.is_mesh() { data::lit_mesh(self.scene, width / height)? } else { Scene::load(self.scene)? };
        Ok(SceneBuffers::build(&scene)?)
    }

    fn settings(&self, dispatch_samples: Option<u32>) -> RenderSettings {
        let [width, height] = self.size;
        RenderSettings {
            width,
            height,
            samples: self.samples,
            seed: self.seed,
            path: PathSettings { jitter: self.jitter, roulette: self.roulette, ..PathSettings::default() },
            dispatch_samples,
        }
    }

    fn render(
        &self,
        executor: &mut dyn Executor,
        buffers: &SceneBuffers,
        split: Option<u32>,
    ) -> Result<Rendered, Failed> {
        let observe = &mut |_| ControlFlow::Continue(());
        Ok(render(executor, buffers, &self.settings(split), observe)?)
    }

    fn reference(&self, buffers: &SceneBuffers) -> Result<Rendered, Failed> {
        self.render(&mut CpuExecutor::new(Some(1))?, buffers, None)
    }
}

fn same_on_cpu(frame: &Frame) -> Result<(), Failed> {
    let buffers = frame.buffers()?;
    let reference = frame.reference(&buffers)?;
    ensure_shows_something(&reference)?;
    for threads in THREADS {
        let mut executor = CpuExecutor::new(Some(threads))?;
        for split in SPLITS {
            let rendered = frame.render(&mut executor, &buffers, split)?;
            ensure_same(&format!("{threads} threads, dispatches of {split:?}"), &rendered, &reference)?;
        }
    }
    Ok(())
}

fn same_on_gpu(executor: &mut GpuExecutor, frame: &Frame) -> Result<(), Failed> {
    let buffers = frame.buffers()?;
    let reference = frame.reference(&buffers)?;
    for split in SPLITS {
        let rendered = frame.render(executor, &buffers, split)?;
        let what = format!("{}, dispatches of {split:?}", executor.loading());
        ensure_same(&what, &rendered, &reference)?;
    }
    Ok(())
}

fn ensure_shows_something(rendered: &Rendered) -> Result<(), Failed> {
    let pixels = &rendered.image.pixels;
    let constant = pixels.len() > 1 && pixels.iter().all(|pixel| pixel == &pixels[0]);
    let black = pixels.as_flattened().iter().all(|&value| value == 0.0);
    ensure(!constant && !black, || "the picture is constant".to_owned())
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
