//! Techniques of frames at the ends of what frames have: units of length and of light, roughness, sizes of the image, and
//! ten thousand frames.

use super::Effort;
use super::comparison::{Comparison, FAMILY_RATE, GRID, Picture, SIZE, built, pictures};
use super::scenes::{PLAIN, SCALES, Variant};
use crate::stats::{Moments, TileTest, Verdict};
use crate::technique::{self, Trials, configure_by};
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::render::Render;
use restir_host::technique::path::PathSettings;
use restir_host::technique::{Integral, Repeats, Technique};
use restir_shared::layout::FilmPixel;

/// Frames of a picture that is compared.
const FRAMES: u32 = 6;
const EXPOSURES: [i32; 2] = [-40, 40];
/// The preset that is tried where one has to do, if there is one of that name.
const MOVING: &str = "quality";
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
        let comparisons = self.comparisons.iter().filter(|comparison| !comparison.passed());
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
            let render = Render { count: FRAMES, ..Render::new(SIZE, technique.clone()) };
            let lengths = scales.iter().map(|&scale| (format!("lengths x {scale:e}"), Variant { scale, ..PLAIN }));
            let light = EXPOSURES.map(|exposure| (format!("light x 2^{exposure}"), Variant { exposure, ..PLAIN }));
            findings.comparisons.extend(lengths.chain(light).map(|(what, variant)| {
                let name = format!("{}, {name}, {what}", trials.name());
                let scaled = scaled(technique.as_ref(), trials.known.lengths, variant.scale);
                let tested = Render { count: FRAMES, ..Render::new(SIZE, scaled) };
                Comparison::of_two(name, [&tested, &render], restarts, [variant, PLAIN])
            }));
        }
        findings.broken += settings.iter().map(|(_, technique)| small_images(technique.as_ref())).sum::<u64>();
        if let Some((name, technique)) = settings.first() {
            let (verdict, broken) = long_runs(technique.as_ref(), runs);
            findings.long.extend(verdict.map(|verdict| (format!("{}, {name}", trials.name()), verdict)));
            findings.broken += broken;
        }
    }
    findings
}

/// The technique in another unit of length.
fn scaled(technique: &dyn Technique, lengths: &[&str], scale: f64) -> Box<dyn Technique> {
    let mut scaled = technique.boxed();
    for key in lengths {
        let length = technique.value(key).and_then(|value| value.parse::<f64>().ok()).expect("a length");
        configure_by(scaled.as_mut(), &format!("{key}={}", length * scale)).expect("another one");
    }
    scaled
}

/// What is run of a technique: what suits views that move first. All of it converges to path tracing's image.
fn presets(trials: &Trials) -> Vec<(&'static str, Box<dyn Technique>)> {
    let mut rows = trials.rows();
    rows.truncate(trials.technique.presets().len().max(1));
    for (_, technique) in &mut rows {
        configure_by(technique.as_mut(), trials.known.as_path).expect("the harness knows the settings");
        if technique.value("jitter").is_some() {
            configure_by(technique.as_mut(), "jitter=on").expect("on or off");
        }
    }
    rows.sort_by_key(|(name, _)| *name != MOVING);
    rows
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
    let reference = reference(&buffers, technique.integral());
    let test = TileTest { grid: GRID, family_rate: FAMILY_RATE };
    (Some(test.compare(&GRID.moments_of(&batches), &reference)), broken)
}

/// The batches of one run, and how many pixels were broken.
fn long_run(buffers: &SceneBuffers, technique: &dyn Technique, frames: u32, seed: u32) -> (Vec<Picture>, u64) {
    let render = Render { count: frames, accumulate: true, seed, ..Render::new(SIZE, technique.boxed()) };
    let mut batches: Vec<Picture> = Vec::new();
    // there may be several of a frame
    let (mut shown, mut broken) = (0, 0);
    technique::pictures(buffers, &render, &mut |picture| {
        let is_broken = |pixel: &&FilmPixel| pixel.dropped != 0.0 || pixel.sum.iter().any(|x| !x.is_finite());
        broken += picture.iter().filter(is_broken).count() as u64;
        if shown % BATCH == 0 {
            batches.push(vec![[0.0; 3]; picture.len()]);
        }
        for (sum, pixel) in batches.last_mut().into_iter().flatten().zip(picture) {
            *sum = std::array::from_fn(|channel| sum[channel] + f64::from(pixel.sum[channel]) / f64::from(BATCH));
        }
        shown += 1;
    });
    batches.truncate((shown / BATCH) as usize);
    (batches.into_iter().skip((WARM_UP / BATCH) as usize).collect(), broken)
}

/// The same by path tracing.
fn reference(buffers: &SceneBuffers, integral: Integral) -> Vec<Moments> {
    let render = Render { count: REFERENCE_SAMPLES, ..Render::new(SIZE, PathSettings::of(integral)) };
    GRID.moments_of(&pictures(buffers, &render, REFERENCE_IMAGES).0)
}

/// Broken pixels of images in which most neighbours are the pixel itself or beyond the border.
fn small_images(technique: &dyn Technique) -> u64 {
    let render = |size| Render { count: 8, accumulate: true, seed: 3, ..Render::new(size, technique.boxed()) };
    SMALL.map(|size| pictures(&built(PLAIN), &render(size), 1).1).iter().sum()
}

/// The findings as a section of a Markdown document.
pub fn markdown(findings: &Findings) -> String {
    let mut text = format!(
        "\n## Techniques of frames\n
The same scene, the last of {FRAMES} frames, in other units of length and of light, with the same random
numbers: the largest difference of a tile's mean, relative to it, and an upper bound on it as above.\n
| technique, preset and variant | frames | difference | bound | allowed | dropped or not finite |\n|---|---:|---:|---:|---:|---:|\n"
    );
    text.extend(findings.comparisons.iter().map(|comparison| format!("{comparison}\n")));
    let Findings { long, runs: [runs, frames], broken, .. } = findings;
    let judged: Vec<String> = long.iter().map(|(name, long)| format!("{name}: {long}")).collect();
    let long = if long.is_empty() { "too short to judge".to_owned() } else { judged.join("; ") };
    text + &format!(
        "\n{runs} runs of {frames} frames, means of {BATCH} of them after {WARM_UP}, against path tracing: {long}.
Images of 1 x 1, 1 x 9, 9 x 1 and 2 x 2 pixels by all presets, 8 frames each: {broken} pixels dropped or not finite, those of
the long runs included.\n"
    )
}
