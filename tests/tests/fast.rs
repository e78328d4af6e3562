//! The flavour `fast`: other bits than the host's, the same expectation.

use libtest_mimic::{Arguments, Failed, Trial};
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor, Flavour, GpuExecutor};
use restir_host::image::Image;
use restir_host::render::{PathSettings, RenderSettings, render};
use restir_host::scene::Scene;
use restir_host::{Error, Shaders};
use restir_tests::device::{self, Adapter, label};
use restir_tests::stats::{Moments, TileGrid, TileTest};
use restir_tests::suite::ensure;
use std::ops::ControlFlow;
use std::process::ExitCode;

/// How often the z-tests of equal expectations fail. Seeds are fixed: a failure is a bug.
const FAMILY_RATE: f64 = 1.0e-3;
const SIDE: u32 = 32;
const TILE: u32 = 8;
/// Images of each side, and the samples of their pixels.
const RESTARTS: u32 = 128;
const SAMPLES: u32 = 16;
/// Pairs of images with the same seed.
const PAIRS: u32 = 16;
/// A bias of the image's mean that must be noticed with 99 % probability.
const GOAL_IMAGE: f64 = 0.025;
const GRID: TileGrid = TileGrid {
    width: SIDE,
    height: SIDE,
    tile: TILE,
};

fn main() -> ExitCode {
    let trials = device::trials("fast", |adapter| {
        ["cornell", "furnace"].map(|scene| trial(adapter, scene)).into()
    });
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}

fn trial(adapter: &Adapter, scene: &'static str) -> Trial {
    adapter.trial(
        &format!("{scene}: the mean of fast is that of exact"),
        move |executor| same_mean(executor, scene),
    )
}

/// An image a seed.
fn images(executor: &mut dyn Executor, scene: &SceneBuffers, seeds: std::ops::Range<u32>) -> Result<Vec<Image>, Error> {
    let image = |seed| {
        let settings = RenderSettings {
            width: SIDE,
            height: SIDE,
            samples: SAMPLES,
            seed,
            path: PathSettings {
                jitter: true,
                roulette: true,
                ..PathSettings::default()
            },
            dispatch_samples: None,
        };
        Ok(render(executor, scene, &settings, &mut |_| ControlFlow::Continue(()))?.image)
    };
    seeds.map(image).collect()
}

fn moments(images: &[Image]) -> Vec<Moments> {
    GRID.moments(images.len() as u32, |restart, x, y| {
        images[restart as usize].pixels[(y * SIDE + x) as usize].map(f64::from)
    })
}

fn same_mean(executor: &mut GpuExecutor, scene: &str) -> Result<(), Failed> {
    let buffers = SceneBuffers::build(&Scene::load(scene)?)?;
    let mut cpu = CpuExecutor::new(None)?;
    let mut fast = executor.reload(Flavour::Fast, Shaders::from_env());
    let tested = images(&mut fast, &buffers, 0..RESTARTS)?;
    let reference = images(&mut cpu, &buffers, RESTARTS..2 * RESTARTS)?;
    let same_seeds = images(&mut cpu, &buffers, 0..PAIRS)?;
    let test = TileTest {
        grid: GRID,
        family_rate: FAMILY_RATE,
    };
    let verdict = test.compare(&moments(&tested), &moments(&reference));
    println!("{}, {}, {scene}: {verdict}", label(&fast), fast.loading());
    println!(
        "  same seed: the means of two images differ by {:.1e} at most",
        largest_difference(&tested, &same_seeds)
    );
    ensure(verdict.passed(), || verdict.to_string())?;
    ensure(verdict.detectable_in_image <= GOAL_IMAGE, || {
        format!("too few samples: {verdict}")
    })
}

/// The largest relative difference between the means of two images.
fn largest_difference(tested: &[Image], reference: &[Image]) -> f64 {
    let mean = |image: &Image| image.pixels.as_flattened().iter().copied().map(f64::from).sum::<f64>();
    let differences = tested
        .iter()
        .zip(reference)
        .map(|(a, b)| (mean(a) / mean(b) - 1.0).abs());
    differences.fold(0.0, f64::max)
}
