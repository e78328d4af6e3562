//! ReSTIR DI at the ends of what frames have: units of length and of light, roughness, sizes of the image, and ten
//! thousand frames.

use super::Effort;
use super::scenes::{Comparison, PLAIN, Variant, largest_difference, scene};
use crate::stats::{Moments, TileGrid, TileTest, Verdict};
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::di::{self, Render, DiSettings};
use restir_host::exec::{CpuExecutor, Executor};
use restir_kernels::di::{di_gather, di_shade};
use restir_shared::layout::FilmPixel;
use restir_shared::technique::path;
use restir_shared::technique::path::{PATH_JITTER, PathParams};
use std::fmt::Write;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

const GRID: TileGrid = TileGrid { width: 16, height: 16, tile: 8 };
/// Frames of a picture that is compared.
const FRAMES: u32 = 6;
const SCALES: [f64; 4] = [1.0e-4, 1.0e-2, 1.0e3, 1.0e5];
const EXPOSURES: [i32; 2] = [-40, 40];
/// The largest difference, as a share of a tile's mean.
const ALLOWED: f64 = 0.005;
/// How often the test for drift fails although there is none.
const FAMILY_RATE: f64 = 1.0e-3;
/// Frames whose mean is one number of that test: many times as long as reservoirs remember.
const BATCH: u32 = 250;
/// Frames before the first batch.
const WARM_UP: u32 = 250;
/// Fewer have no spread to judge by.
const FEWEST_BATCHES: usize = 100;
const REFERENCE_IMAGES: u32 = 8192;
/// Width and height of images that are smaller than a neighbourhood.
const SMALL: [[u32; 2]; 4] = [[1, 1], [1, 9], [9, 1], [2, 2]];

/// What was found.
#[derive(Clone, Debug)]
pub struct Findings {
    /// Pictures at the ends of ranges against those of the plain scene.
    pub comparisons: Vec<Comparison>,
    /// Long runs against path tracing; none of runs too short to judge.
    pub long: Option<Verdict>,
    /// How many there were, and of how many frames.
    pub runs: [u32; 2],
    /// Pixels that were dropped or are no finite numbers, of the long run and of the small images.
    pub broken: u64,
}

impl Findings {
    /// What did not pass.
    pub fn failed(&self) -> Vec<String> {
        let comparisons = self.comparisons.iter().filter(|c| c.broken > 0 || c.bound > ALLOWED);
        let mut failed: Vec<String> = comparisons.map(|c| format!("ReSTIR DI, {}", c.name)).collect();
        if let Some(long) = self.long.as_ref().filter(|long| !long.passed()) {
            failed.push(format!("ReSTIR DI over {} frames: {long}", self.runs[1]));
        }
        if self.broken > 0 {
            failed.push(format!("ReSTIR DI: {} broken pixels", self.broken));
        }
        failed
    }
}

/// Runs everything.
pub fn run(effort: Effort) -> Findings {
    let (restarts, scales, presets, runs) = match effort {
        Effort::Reduced => (2, &SCALES[3..], &["quality"][..], [1, 200]),
        Effort::Full => (64, &SCALES[..], &DiSettings::PRESETS[..], [4, 10_000]),
    };
    let mut comparisons = Vec::new();
    for &preset in presets {
        let mut add = |name: String, variant| comparisons.push(compare(name, preset, variant, restarts));
        for &scale in scales {
            add(format!("{preset}, lengths x {scale:e}"), Variant { scale, ..PLAIN });
        }
        for exposure in EXPOSURES {
            add(format!("{preset}, light x 2^{exposure}"), Variant { exposure, ..PLAIN });
        }
    }
    let (long, broken) = long_runs(runs);
    Findings { comparisons, long, runs, broken: broken + small_images() }
}

fn render(preset: &str, frames: u32, seed: u32) -> Render {
    // through the scene's clear glass paths of two segments see no light
    let settings = DiSettings { jitter: true, transmittance: false, ..DiSettings::preset(preset).unwrap_or_default() };
    Render { count: frames, seed, ..Render::new([GRID.width, GRID.height], settings) }
}

/// The picture of each pass of shading: of the last frame, or of all if the render accumulates.
fn pictures(buffers: &SceneBuffers, render: &Render, observe: &mut dyn FnMut(&[FilmPixel])) {
    let result = CpuExecutor::inline().run_shown(di::plan(buffers, render), &mut |step| {
        if [di_gather::DESC.name, di_shade::DESC.name].contains(&step.pass.kernel.name) {
            observe(&step.plane("film")?);
        }
        Ok(())
    });
    result.expect("the plan fits its kernels");
}

fn is_broken(pixel: &FilmPixel) -> bool {
    pixel.dropped != 0.0 || pixel.sum.iter().any(|x| !x.is_finite())
}

/// Same random numbers, another unit: the pictures are the same but for roundings that change a choice.
fn compare(name: String, preset: &str, variant: Variant, restarts: u32) -> Comparison {
    let [tested, reference] = [variant, PLAIN].map(|v| SceneBuffers::build(&scene(v)).expect("the scene is valid"));
    let unit = 2.0_f64.powi(-variant.exposure);
    let broken = AtomicU64::new(0);
    let all = |buffers: &SceneBuffers, unit: f64| -> Vec<Vec<[f64; 3]>> {
        let picture = |seed| {
            let mut picture = Vec::new();
            pictures(buffers, &render(preset, FRAMES, seed), &mut |pixels| {
                broken.fetch_add(pixels.iter().filter(|pixel| is_broken(pixel)).count() as u64, Relaxed);
                picture = pixels.iter().map(|pixel| pixel.sum.map(|x| f64::from(x) * unit)).collect();
            });
            picture
        };
        (0..restarts).into_par_iter().map(picture).collect()
    };
    let (tested, reference) = (all(&tested, unit), all(&reference, 1.0));
    let at = |x: u32, y: u32| (y * GRID.width + x) as usize;
    let means = GRID.moments(restarts, |seed, x, y| reference[seed as usize][at(x, y)]);
    let differences = GRID.moments(restarts, |seed, x, y| {
        let (a, b) = (tested[seed as usize][at(x, y)], reference[seed as usize][at(x, y)]);
        std::array::from_fn(|channel| a[channel] - b[channel])
    });
    let (difference, bound) = largest_difference(&means, &differences);
    Comparison { name, paths: restarts * FRAMES, difference, bound, broken: broken.into_inner() }
}

/// Confidence stays at its cap, and the mean stays where it is: batches of frames against path tracing.
fn long_runs([runs, frames]: [u32; 2]) -> (Option<Verdict>, u64) {
    let buffers = SceneBuffers::build(&scene(PLAIN)).expect("the scene is valid");
    let runs: Vec<_> = (0..runs).into_par_iter().map(|seed| long_run(&buffers, frames, seed)).collect();
    let broken = runs.iter().map(|(_, broken)| broken).sum();
    let batches: Vec<_> = runs.into_iter().flat_map(|(batches, _)| batches).collect();
    if batches.len() < FEWEST_BATCHES {
        return (None, broken);
    }
    let tested = GRID.moments(batches.len() as u32, |b, x, y| batches[b as usize][(y * GRID.width + x) as usize]);
    (Some(TileTest { grid: GRID, family_rate: FAMILY_RATE }.compare(&tested, &reference(&buffers))), broken)
}

/// The batches of one run, and how many pixels were broken.
fn long_run(buffers: &SceneBuffers, frames: u32, seed: u32) -> (Vec<Vec<[f64; 3]>>, u64) {
    let render = Render { accumulate: true, ..render("quality", frames, seed) };
    let black = || vec![[0.0; 3]; (GRID.width * GRID.height) as usize];
    let (mut batches, mut batch) = (Vec::new(), black());
    let (mut frame, mut broken) = (0, 0);
    pictures(buffers, &render, &mut |picture| {
        broken += picture.iter().filter(|pixel| is_broken(pixel)).count() as u64;
        for (sum, pixel) in batch.iter_mut().zip(picture) {
            *sum = std::array::from_fn(|channel| sum[channel] + f64::from(pixel.sum[channel]) / f64::from(BATCH));
        }
        frame += 1;
        if frame % BATCH == 0 {
            let full = std::mem::replace(&mut batch, black());
            if frame > WARM_UP {
                batches.push(full);
            }
        }
    });
    (batches, broken)
}

/// Direct light by path tracing.
fn reference(buffers: &SceneBuffers) -> Vec<Moments> {
    let params = PathParams {
        scene: buffers.header,
        camera: buffers.camera.params(GRID.width, GRID.height),
        width: GRID.width,
        height: GRID.height,
        block_log2: 4,
        max_depth: 2,
        flags: PATH_JITTER,
        ..PathParams::default()
    };
    let view = buffers.view();
    GRID.moments(REFERENCE_IMAGES, |seed, x, y| {
        path::pixel(&view, &PathParams { seed, ..params }, x, y).sum.map(|sum| f64::from(sum) / 16.0)
    })
}

/// Images in which most neighbours are the pixel itself or beyond the border.
fn small_images() -> u64 {
    let buffers = SceneBuffers::build(&scene(PLAIN)).expect("the scene is valid");
    let mut broken = 0;
    for [width, height] in SMALL {
        for preset in DiSettings::PRESETS {
            let render = Render { width, height, accumulate: true, ..render(preset, 8, 3) };
            let mut pixels = 0;
            pictures(&buffers, &render, &mut |picture| {
                pixels += picture.len();
                broken += picture.iter().filter(|pixel| is_broken(pixel)).count() as u64;
            });
            broken += u64::from(pixels != (8 * render.settings.shading_passes() * width * height) as usize);
        }
    }
    broken
}

/// The findings as a section of a Markdown document.
pub fn markdown(findings: &Findings) -> String {
    let mut text = format!(
        "\n## ReSTIR DI\n
The same scene, direct light, the last of {FRAMES} frames, in other units of length and of light, with the same random
numbers: the largest difference of a tile's mean, relative to it, and an upper bound on it as above.\n
| preset and variant | frames | difference | bound | allowed | dropped or not finite |\n|---|---:|---:|---:|---:|---:|\n"
    );
    for Comparison { name, paths, difference, bound, broken } in &findings.comparisons {
        writeln!(text, "| {name} | {paths} | {difference:.1e} | {bound:.1e} | {ALLOWED:.0e} | {broken} |")
            .expect("a String takes all text");
    }
    let Findings { long, runs: [runs, frames], broken, .. } = findings;
    let long = long.as_ref().map_or_else(|| "too short to judge".to_owned(), Verdict::to_string);
    writeln!(
        text,
        "\nPreset quality, {runs} runs of {frames} frames, means of {BATCH} of them after {WARM_UP}, against path tracing: {long}.
Images of 1 x 1, 1 x 9, 9 x 1 and 2 x 2 pixels in all presets, 8 frames each: {broken} pixels dropped or not finite, those of
the long runs included."
    )
    .expect("a String takes all text");
    text
}
