//! The flavour `fast`: other bits than the host's, the same expectation.
//!
//! Both sides take the same seeds. Most paths are then the same and few numbers differ, so that the difference of two
//! images varies far less than either: a small bias shows in few images.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor, Flavour, GpuExecutor};
use restir_host::image::Image;
use restir_host::render::Render;
use restir_host::technique::Technique;
use restir_host::{Error, Shaders};
use restir_tests::bias::{ensure_biased, ensure_unbiased};
use restir_tests::device::{self, Adapter, label};
use restir_tests::scenes::buffers;
use restir_tests::stats::{Moments, TileGrid, TileTest, Verdict};
use restir_tests::suite::Trial;
use restir_tests::technique::Trials;
use std::ops::Range;

/// How often the z-tests of equal expectations fail. Seeds are fixed: a failure is a bug.
const FAMILY_RATE: f64 = 1.0e-3;
const SIDE: u32 = 32;
const TILE: u32 = 8;
const SCENES: [&str; 2] = ["cornell", "furnace"];
/// Technique, scene and settings, beside the default ones of every technique in these scenes.
const MORE: [(&str, &str, &str); 4] = [
    ("path", "slab", "max_depth=4,longest_walk=100"),
    ("path", "slab", "max_depth=4,subsurface=hybrid"),
    ("restir-di", "cornell", "preset=quality,mis=talbot,tiles=4x64,jitter=on"),
    ("restir-pt", "cornell", "shift=hybrid,spatial=2,feedback=on,direct=restir-di"),
];
/// Images of each side, and the samples of their pixels. There are twice as many until [`GOAL_IMAGE`] is reached, on which alone it depends how many
/// there are: an adapter that contracts more has paths that differ more.
const PAIRS: [u32; 2] = [16, 1024];
const SAMPLES: u32 = 16;
/// A bias of the image's mean that must be noticed with 99 % probability.
const GOAL_IMAGE: f64 = 0.001;
/// A bias that must be seen when it is added.
const WRONG: f32 = 1.002;
const TEST: TileTest = TileTest { grid: TileGrid { width: SIDE, height: SIDE, tile: TILE }, family_rate: FAMILY_RATE };

pub(crate) fn trials() -> Vec<Trial> {
    device::trials(|adapter| {
        let rows = Trials::all().into_iter().map(|trials| (trials.name(), trials.technique));
        let usual = rows.flat_map(|(name, technique)| SCENES.map(|scene| (scene, name.to_owned(), technique.clone())));
        let more = MORE.iter().map(|&(name, scene, settings)| {
            let technique = Trials::of(name).and_then(|trials| trials.with(settings));
            (scene, format!("{name}:{settings}"), technique.expect("the harness knows the settings"))
        });
        usual.chain(more).map(|(scene, name, technique)| trial(adapter, scene, &name, technique)).collect()
    })
}

fn trial(adapter: &Adapter, scene: &'static str, name: &str, technique: Box<dyn Technique>) -> Trial {
    adapter.trial(&format!("{scene}, {name}: the mean of fast is that of exact"), move |executor| {
        same_mean(executor, scene, technique)
    })
}

/// An image a seed: the mean of samples, or of frames one after another.
fn images(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    technique: &dyn Technique,
    seeds: Range<u32>,
) -> Result<Vec<Image>, Error> {
    let image = |seed| {
        let technique = technique.boxed();
        let settings = Render { count: SAMPLES, accumulate: true, seed, ..Render::new([SIDE; 2], technique) };
        Ok(settings.render(scene, executor)?.image)
    };
    seeds.map(image).collect()
}

fn radiance(image: &Image, x: u32, y: u32) -> [f64; 3] {
    image.pixels[(y * SIDE + x) as usize].map(f64::from)
}

/// Tests the mean of `scale` times `tested` less `exact`, pair by pair, against zero.
fn paired(tested: &[Image], exact: &[Image], scale: f32) -> Verdict {
    let pairs = exact.len() as u32;
    let differences = TEST.grid.moments(pairs, |pair, x, y| {
        let [a, b] = [tested, exact].map(|images| radiance(&images[pair as usize], x, y));
        std::array::from_fn(|channel| f64::from(scale) * a[channel] - b[channel])
    });
    let means = TEST.grid.moments(pairs, |pair, x, y| radiance(&exact[pair as usize], x, y));
    // the means only give the scale: the noise of the pairs is that of their differences
    let scales: Vec<Moments> = means.iter().map(|m| Moments::exact(m.mean())).collect();
    let tested: Vec<Moments> =
        differences.iter().zip(&means).map(|(difference, mean)| difference.shifted(mean.mean())).collect();
    TEST.compare(&tested, &scales)
}

fn same_mean(executor: &mut GpuExecutor, scene: &str, technique: Box<dyn Technique>) -> Result<(), Failed> {
    let buffers = buffers(scene)?;
    let mut fast = executor.reload(Flavour::Fast, Shaders::Embedded);
    let (mut host, what) = (CpuExecutor::new()?, format!("{}, {}, {scene}", label(&fast), fast.loading()));
    let ([mut pairs, most], mut tested, mut exact) = (PAIRS, Vec::new(), Vec::new());
    let verdict = loop {
        let seeds = exact.len() as u32..pairs;
        tested.extend(images(&mut fast, &buffers, technique.as_ref(), seeds.clone())?);
        exact.extend(images(&mut host, &buffers, technique.as_ref(), seeds)?);
        let verdict = paired(&tested, &exact, 1.0);
        if verdict.detectable_in_image <= GOAL_IMAGE || pairs == most {
            break verdict;
        }
        pairs *= 2;
    };
    ensure_unbiased(&what, &verdict, GOAL_IMAGE)?;
    ensure_biased("a bias of 0.2 %", &paired(&tested, &exact, WRONG))
}
