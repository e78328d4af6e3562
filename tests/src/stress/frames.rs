//! Techniques of frames at the ends of what frames have: units of length and of light, roughness, sizes of the image, and
//! ten thousand frames.

use super::Effort;
use super::scenes::{Comparison, PLAIN, Variant, largest_difference, scene};
use crate::stats::{Moments, TileGrid, TileTest, Verdict};
use crate::technique::{Trials, configure_by, pictures};
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::{self, Render, Rendered};
use restir_host::technique::path::PathSettings;
use restir_host::technique::{Integral, Repeats, Technique};
use restir_shared::layout::FilmPixel;
use std::fmt::Write;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

const GRID: TileGrid = TileGrid { width: 16, height: 16, tile: 8 };
/// Frames of a picture that is compared.
const FRAMES: u32 = 6;
const SCALES: [f64; 4] = [1.0e-4, 1.0e-2, 1.0e3, 1.0e5];
const EXPOSURES: [i32; 2] = [-40, 40];
/// The largest difference, as a share of a tile's mean.
const ALLOWED: f64 = 0.005;
/// The preset that is tried where one has to do, if there is one of that name.
const MOVING: &str = "quality";
/// How often the test for drift fails although there is none.
const FAMILY_RATE: f64 = 1.0e-3;
/// Frames whose mean is one number of that test: many times as long as reservoirs remember.
const BATCH: u32 = 250;
/// Frames before the first batch.
const WARM_UP: u32 = 250;
/// Fewer have no spread to judge by.
const FEWEST_BATCHES: usize = 100;
const REFERENCE_IMAGES: u32 = 8192;
/// Samples of each.
const REFERENCE_SAMPLES: u32 = 16;
/// Width and height of images that are smaller than a neighbourhood.
const SMALL: [[u32; 2]; 4] = [[1, 1], [1, 9], [9, 1], [2, 2]];

/// What was found.
#[derive(Clone, Debug)]
pub struct Findings {
    /// Pictures at the ends of ranges against those of the plain scene.
    pub comparisons: Vec<Comparison>,
    /// Long runs against path tracing, by technique; none of runs too short to judge.
    pub long: Vec<(String, Verdict)>,
    /// How many there were, and of how many frames.
    pub runs: [u32; 2],
    /// Pixels that were dropped or are no finite numbers, of the long run and of the small images.
    pub broken: u64,
}

impl Findings {
    /// What did not pass.
    pub fn failed(&self) -> Vec<String> {
        let comparisons = self.comparisons.iter().filter(|c| c.broken > 0 || c.bound > ALLOWED);
        let mut failed: Vec<String> = comparisons.map(|c| c.name.clone()).collect();
        for (name, long) in self.long.iter().filter(|(_, long)| !long.passed()) {
            failed.push(format!("{name} over {} frames: {long}", self.runs[1]));
        }
        if self.broken > 0 {
            failed.push(format!("techniques of frames: {} broken pixels", self.broken));
        }
        failed
    }
}

/// Runs everything: of each technique of frames the first of its settings, or all.
pub fn run(effort: Effort) -> Findings {
    let (restarts, scales, rows, runs) = match effort {
        Effort::Reduced => (2, &SCALES[3..], 1, [1, 200]),
        Effort::Full => (64, &SCALES[..], usize::MAX, [4, 10_000]),
    };
    let is_of_frames = |trials: &Trials| trials.technique.about().repeats == Repeats::Frames;
    let mut findings = Findings { comparisons: Vec::new(), long: Vec::new(), runs, broken: 0 };
    for trials in Trials::all().into_iter().filter(is_of_frames) {
        let settings = presets(&trials);
        for (name, technique) in settings.iter().take(rows) {
            let name = format!("{}, {name}", trials.name());
            let mut add = |what: String, variant| {
                findings.comparisons.push(compare(format!("{name}, {what}"), technique.as_ref(), variant, restarts));
            };
            for &scale in scales {
                add(format!("lengths x {scale:e}"), Variant { scale, ..PLAIN });
            }
            for exposure in EXPOSURES {
                add(format!("light x 2^{exposure}"), Variant { exposure, ..PLAIN });
            }
        }
        findings.broken += small_images(settings.iter().map(|(_, technique)| technique.as_ref()));
        if let Some((name, technique)) = settings.first() {
            let (verdict, broken) = long_runs(technique.as_ref(), runs);
            findings.long.extend(verdict.map(|verdict| (format!("{}, {name}", trials.name()), verdict)));
            findings.broken += broken;
        }
    }
    findings
}

/// What is run of a technique: what suits views that move first. All of it converges to path tracing's image.
fn presets(trials: &Trials) -> Vec<(&'static str, Box<dyn Technique>)> {
    let mut rows = trials.rows();
    rows.truncate(trials.technique.presets().len().max(1));
    for (_, technique) in &mut rows {
        configure_by(technique.as_mut(), trials.known.as_path).expect("the harness knows the settings");
        configure_by(technique.as_mut(), "jitter=on").expect("techniques of frames have jitter");
    }
    rows.sort_by_key(|(name, _)| *name != MOVING);
    rows
}

/// A render on the caller's thread.
fn rendered(buffers: &SceneBuffers, render: &Render) -> Rendered {
    render::render(&mut CpuExecutor::inline(), buffers, render, &mut |_| Ok(())).expect("the settings are sound")
}

fn broken_pixels(rendered: &Rendered) -> u64 {
    let finite = |pixel: &[f32; 3]| pixel.iter().all(|x| x.is_finite());
    rendered.dropped_samples + rendered.image.pixels.iter().filter(|pixel| !finite(pixel)).count() as u64
}

fn built(variant: Variant) -> SceneBuffers {
    SceneBuffers::build(&scene(variant)).expect("the scene is valid")
}

/// Same random numbers, another unit: the pictures are the same but for roundings that change a choice.
fn compare(name: String, technique: &dyn Technique, variant: Variant, restarts: u32) -> Comparison {
    let unit = 2.0_f64.powi(-variant.exposure);
    let broken = AtomicU64::new(0);
    let all = |buffers: SceneBuffers, unit: f64| -> Vec<Vec<[f64; 3]>> {
        let picture = |seed| {
            let size = [GRID.width, GRID.height];
            let rendered = rendered(&buffers, &Render { count: FRAMES, seed, ..Render::new(size, technique.boxed()) });
            broken.fetch_add(broken_pixels(&rendered), Relaxed);
            rendered.image.pixels.iter().map(|pixel| pixel.map(|x| f64::from(x) * unit)).collect()
        };
        (0..restarts).into_par_iter().map(picture).collect()
    };
    let (tested, reference) = (all(built(variant), unit), all(built(PLAIN), 1.0));
    let at = |x: u32, y: u32| (y * GRID.width + x) as usize;
    let means = GRID.moments(restarts, |seed, x, y| reference[seed as usize][at(x, y)]);
    let differences = GRID.moments(restarts, |seed, x, y| {
        let (a, b) = (tested[seed as usize][at(x, y)], reference[seed as usize][at(x, y)]);
        std::array::from_fn(|channel| a[channel] - b[channel])
    });
    let (difference, bound) = largest_difference(&means, &differences);
    Comparison { name, paths: restarts * FRAMES, difference, bound, broken: broken.into_inner() }
}

/// The mean stays where it is, however long a history is: batches of frames against path tracing.
fn long_runs(technique: &dyn Technique, [runs, frames]: [u32; 2]) -> (Option<Verdict>, u64) {
    let buffers = built(PLAIN);
    let runs: Vec<_> = (0..runs).into_par_iter().map(|seed| long_run(&buffers, technique, frames, seed)).collect();
    let broken = runs.iter().map(|(_, broken)| broken).sum();
    let batches: Vec<_> = runs.into_iter().flat_map(|(batches, _)| batches).collect();
    if batches.len() < FEWEST_BATCHES {
        return (None, broken);
    }
    let tested = GRID.moments(batches.len() as u32, |b, x, y| batches[b as usize][(y * GRID.width + x) as usize]);
    let reference = reference(&buffers, technique.integral());
    (Some(TileTest { grid: GRID, family_rate: FAMILY_RATE }.compare(&tested, &reference)), broken)
}

/// The batches of one run, and how many pixels were broken.
fn long_run(buffers: &SceneBuffers, technique: &dyn Technique, frames: u32, seed: u32) -> (Vec<Vec<[f64; 3]>>, u64) {
    let size = [GRID.width, GRID.height];
    let render = Render { count: frames, accumulate: true, seed, ..Render::new(size, technique.boxed()) };
    let black = || vec![[0.0; 3]; (GRID.width * GRID.height) as usize];
    let (mut batches, mut batch) = (Vec::new(), black());
    let (mut made, mut broken) = (0, 0);
    pictures(buffers, &render, &mut |picture| {
        let is_broken = |pixel: &&FilmPixel| pixel.dropped != 0.0 || pixel.sum.iter().any(|x| !x.is_finite());
        broken += picture.iter().filter(is_broken).count() as u64;
        for (sum, pixel) in batch.iter_mut().zip(picture) {
            *sum = std::array::from_fn(|channel| sum[channel] + f64::from(pixel.sum[channel]) / f64::from(BATCH));
        }
        made += 1;
        if made % BATCH == 0 {
            let full = std::mem::replace(&mut batch, black());
            if made > WARM_UP {
                batches.push(full);
            }
        }
    });
    (batches, broken)
}

/// The same by path tracing.
fn reference(buffers: &SceneBuffers, Integral { max_depth, jitter }: Integral) -> Vec<Moments> {
    let settings = PathSettings { max_depth, jitter, ..PathSettings::default() };
    let render = Render { count: REFERENCE_SAMPLES, ..Render::new([GRID.width, GRID.height], settings) };
    let images: Vec<Rendered> = (0..REFERENCE_IMAGES)
        .into_par_iter()
        .map(|seed| rendered(buffers, &Render { seed, ..render.clone() }))
        .collect();
    let at = |x: u32, y: u32| (y * GRID.width + x) as usize;
    GRID.moments(REFERENCE_IMAGES, |seed, x, y| images[seed as usize].image.pixels[at(x, y)].map(f64::from))
}

/// Images in which most neighbours are the pixel itself or beyond the border.
fn small_images<'a>(techniques: impl Iterator<Item = &'a dyn Technique>) -> u64 {
    let buffers = built(PLAIN);
    let renders = techniques.flat_map(|technique| {
        SMALL.map(|size| Render { count: 8, accumulate: true, seed: 3, ..Render::new(size, technique.boxed()) })
    });
    renders.map(|render| broken_pixels(&rendered(&buffers, &render))).sum()
}

/// The findings as a section of a Markdown document.
pub fn markdown(findings: &Findings) -> String {
    let mut text = format!(
        "\n## Techniques of frames\n
The same scene, the last of {FRAMES} frames, in other units of length and of light, with the same random
numbers: the largest difference of a tile's mean, relative to it, and an upper bound on it as above.\n
| technique, preset and variant | frames | difference | bound | allowed | dropped or not finite |\n|---|---:|---:|---:|---:|---:|\n"
    );
    for Comparison { name, paths, difference, bound, broken } in &findings.comparisons {
        writeln!(text, "| {name} | {paths} | {difference:.1e} | {bound:.1e} | {ALLOWED:.0e} | {broken} |")
            .expect("a String takes all text");
    }
    let Findings { long, runs: [runs, frames], broken, .. } = findings;
    let judged: Vec<String> = long.iter().map(|(name, long)| format!("{name}: {long}")).collect();
    let long = if long.is_empty() { "too short to judge".to_owned() } else { judged.join("; ") };
    writeln!(
        text,
        "\n{runs} runs of {frames} frames, means of {BATCH} of them after {WARM_UP}, against path tracing: {long}.
Images of 1 x 1, 1 x 9, 9 x 1 and 2 x 2 pixels by all presets, 8 frames each: {broken} pixels dropped or not finite, those of
the long runs included."
    )
    .expect("a String takes all text");
    text
}
