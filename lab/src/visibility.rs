//! `cargo lab visibility`: averaged visibility (Tokuyoshi) against that of the selected sample, in error and variance,
//! and the report of it.

use std::time::Instant;

use crate::bootstrap::Interval;
use clap::Args;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::replay::Recording;
use restir_host::settings::Choice as _;
use restir_host::technique::restir_di::{DiSettings, Target, Visibility, VisibilityReuse};
use restir_shared::scene::Still;
use restir_shared::technique::path::{self, PathParams};
use restir_tests::random::SplitMix;
use restir_tests::scenes::{ROW, coloured, penumbra, spread, white};
use restir_tests::visibility::{Restart, Run, settings, visibility_moments};

use crate::{Error, report};

const SIZE: u32 = 64;
/// Frames of a restart, and the first that counts.
const FRAMES: [u32; 2] = [16, 8];
/// What is resampled: batches of restarts, and of the reference's samples.
const BATCHES: u32 = 64;
/// Samples of the path tracer for a pixel of a batch.
const REFERENCE_SAMPLES: u32 = 256;
const RESAMPLES: u32 = 500;
const RESAMPLES_OF_VARIANCE: u32 = 200;
/// Reference values below this part of their mean do not count in RMSPE.
const DARK: f64 = 1.0e-3;
/// Pixels in part shadow have a mean visibility in this range.
const PARTIAL: std::ops::Range<f64> = 0.05..0.95;
/// Frames and side of the picture whose rays are counted.
const COUNTED: [u32; 2] = [8, 32];
/// Of the selected sample ("prev"), and averaged ("ours").
const METHODS: [Visibility; 2] = [Visibility::Selected, Visibility::Averaged];
/// The channels of the rows of three renders.
const CHANNELS: [Target; 3] = [Target::Red, Target::Green, Target::Blue];
/// The row of three renders.
const BY_CHANNEL: &str = "coloured, a render for each channel";
/// Distances in pixels within which neighbours are believed to see the same.
const NEAR_RADII: [f32; 5] = [0.0, 1.5, 2.5, 3.5, 100.0];

/// A way to place lights before a wall.
struct Arrangement {
    name: &'static str,
    buffers: fn(coloured: bool) -> SceneBuffers,
    /// It is made to be as bad as can be for colour, so the bound on the leak is not claimed for it.
    adversarial: bool,
}

const ARRANGEMENTS: [Arrangement; 2] = [
    Arrangement {
        name: "spread",
        buffers: |coloured| SceneBuffers::build(&spread(coloured)).expect("a test scene is valid"),
        adversarial: false,
    },
    Arrangement {
        name: "row",
        buffers: |with_hues| penumbra(if with_hues { coloured } else { white }).buffers(),
        adversarial: true,
    },
];

/// Options of `cargo lab visibility`.
#[derive(Args)]
pub struct Options {
    /// Independent restarts of each setting, in whole batches of 64.
    #[arg(long, default_value_t = 64)]
    restarts: u32,
    /// Replace docs/visibility.md.
    #[arg(long)]
    write: bool,
}

/// Measures, prints the report and writes it where asked, also if a claim does not hold: the report says so.
///
/// # Errors
/// [`Error::Failed`] if a claim does not hold or is undecided; [`Error::Io`] if the report cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
    let start = Instant::now();
    let restarts = options.restarts.max(1).next_multiple_of(BATCHES);
    let findings = Findings::measure(restarts);
    eprintln!("{:.0} s", start.elapsed().as_secs_f64());
    report::publish("visibility", &findings.report(restarts), options.write)?;
    let failed = findings.claims().into_iter().filter(|claim| claim.required && claim.holds != Some(true));
    report::judge("not shown", failed.map(|claim| claim.text))
}

/// Independent images of the same expectation, all values of a picture each.
type Images = Vec<Vec<f64>>;

/// Mean and variance of each value, of images that count `times` each.
fn moments(images: &[impl AsRef<[f64]>], times: &[f64]) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 2]; images[0].as_ref().len()];
    for (image, times) in images.iter().zip(times) {
        for ([sum, squares], x) in sums.iter_mut().zip(image.as_ref()) {
            (*sum, *squares) = (*sum + times * x, *squares + times * x * x);
        }
    }
    let count: f64 = times.iter().sum();
    sums.into_iter().map(|[sum, squares]| [sum / count, (squares - sum * sum / count) / (count - 1.0)]).collect()
}

fn mean(images: &[impl AsRef<[f64]>]) -> Vec<f64> {
    moments(images, &vec![1.0; images.len()]).into_iter().map(|[mean, _]| mean).collect()
}

/// The statistics of a comparison, in the order of the report.
const STATISTICS: [&str; 6] = [
    "RMSPE(prev, ref)",
    "RMSPE(ours, ref)",
    "difference, points",
    "RMSPE(ours, prev)",
    "mean error of prev, %",
    "mean error of ours, %",
];
const DIFFERENCE: usize = 2;
const DIRECT: usize = 3;
const MEAN_ERRORS: [usize; 2] = [4, 5];

/// The selected sample's visibility ("prev"), the averaged one ("ours") and the reference.
struct Comparison {
    prev: Images,
    ours: Images,
    /// Ours less prev: they share seeds.
    change: Images,
    reference: Images,
    counts: Vec<bool>,
}

impl Comparison {
    fn new([prev, ours]: [Images; 2], reference: Images) -> Self {
        let change = ours.iter().zip(&prev).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect()).collect();
        let mean = mean(&reference);
        let dark = DARK * mean.iter().sum::<f64>() / mean.len() as f64;
        Self { prev, ours, change, counts: mean.iter().map(|&r| r > dark).collect(), reference }
    }

    /// The values that count.
    fn values(&self) -> impl Iterator<Item = usize> {
        (0..self.counts.len()).filter(|&i| self.counts[i])
    }

    /// Of batches that count so often. Corrected for noise: the variances of the mean images, which are `noise` times those
    /// of the batches, are taken off the squared errors.
    fn statistics(&self, times: &[f64], reference_times: &[f64], noise: f64) -> [f64; STATISTICS.len()] {
        let [prev, ours, change] = [&self.prev, &self.ours, &self.change].map(|images| moments(images, times));
        let reference = moments(&self.reference, reference_times);
        let mut squares = [0.0; 3];
        let mut sums = [0.0; 3];
        for i in self.values() {
            let [r, of_reference] = reference[i];
            let off = |[x, variance]: [f64; 2]| (x - r).powi(2) - noise * (variance + of_reference);
            let [direct, variance] = change[i];
            let terms = [off(prev[i]), off(ours[i]), direct.powi(2) - noise * variance];
            squares.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term / (r * r));
            sums.iter_mut().zip([r, prev[i][0], ours[i][0]]).for_each(|(sum, x)| *sum += x);
        }
        // a square that noise took below zero stays visible as such
        let count = self.values().count() as f64;
        let percent = |square: f64| 100.0 * (square.abs() / count).sqrt().copysign(square);
        let [a, b, direct] = squares.map(percent);
        let [r, p, o] = sums;
        [a, b, b - a, direct, 100.0 * (p / r - 1.0), 100.0 * (o / r - 1.0)]
    }

    fn intervals(&self) -> [Interval; STATISTICS.len()] {
        let (once, noise) = (vec![1.0; BATCHES as usize], 1.0 / f64::from(BATCHES));
        let values = self.statistics(&once, &once, noise);
        // as if the means were the truth
        let centers = self.statistics(&once, &once, 0.0);
        let resampled: Vec<_> = (0..RESAMPLES)
            .into_par_iter()
            .map(|i| self.statistics(&resample(2 * i, BATCHES), &resample(2 * i + 1, BATCHES), noise))
            .collect();
        std::array::from_fn(|k| Interval::basic(values[k], centers[k], resampled.iter().map(|all| all[k]).collect()))
    }

    /// The part of the absolute change, relative to the reference, that lies in the given pixels. Noise alone would count
    /// for zero: each half of the restarts says which sign the other half's change should have.
    fn share_of_change(&self, pixels: &[bool]) -> f64 {
        let half = |first| {
            let times: Vec<f64> = (0..BATCHES).map(|i| f64::from(i % 2 == first)).collect();
            moments(&self.change, &times)
        };
        let (a, b, reference) = (half(0), half(1), mean(&self.reference));
        let term = |i: usize| {
            let ([a, _], [b, _]) = (a[i], b[i]);
            (a.signum() * b + b.signum() * a) / reference[i]
        };
        self.values().filter(|i| pixels[i / 3]).map(term).sum::<f64>() / self.values().map(term).sum::<f64>()
    }
}

/// How often each of `count` things is drawn in `count` draws.
fn resample(seed: u32, count: u32) -> Vec<f64> {
    let mut random = SplitMix::new(u64::from(seed));
    let mut times = vec![0.0; count as usize];
    (0..count).for_each(|_| times[(random.unit() * f64::from(count)) as usize] += 1.0);
    times
}

/// Means of batches of restarts.
fn batches(restarts: &[Restart]) -> Images {
    let images: Vec<_> = restarts.iter().map(|restart| restart.image.as_flattened()).collect();
    images.chunks(images.len() / BATCHES as usize).map(mean).collect()
}

/// Of path tracing with one bounce.
fn reference(buffers: &SceneBuffers) -> Images {
    let view = buffers.view();
    let camera = buffers.camera.params(SIZE, SIZE);
    let params =
        PathParams { scene: buffers.header, camera, width: SIZE, height: SIZE, max_depth: 2, ..PathParams::default() };
    let sample = |seed, i| path::pixel(&view, &PathParams { seed, ..params }, i % SIZE, i / SIZE).sum;
    let pixel = |batch: u32, i: u32| {
        let seeds = batch * REFERENCE_SAMPLES..(batch + 1) * REFERENCE_SAMPLES;
        let sum: DVec3 = seeds.map(|seed| Vec3::from(sample(seed, i)).as_dvec3()).sum();
        (sum / f64::from(REFERENCE_SAMPLES)).to_array()
    };
    (0..BATCHES).into_par_iter().map(|batch| (0..SIZE * SIZE).flat_map(|i| pixel(batch, i)).collect()).collect()
}

fn of_size(settings: DiSettings) -> Run {
    Run { size: [SIZE; 2], frames: FRAMES[0], from: FRAMES[1], settings }
}

/// How much less the visibility of a reservoir varies.
struct Reduction {
    variances: [f64; 2],
    ratio: Interval,
    pixels: usize,
}

impl Reduction {
    /// Over the given pixels.
    fn new(restarts: [&[Restart]; 2], pixels: &[bool]) -> Self {
        let chosen: Vec<usize> = (0..pixels.len()).filter(|&i| pixels[i]).collect();
        let visibility = |restart: &Restart| chosen.iter().map(|&i| f64::from(restart.visibility[i])).collect();
        let images = restarts.map(|restarts| restarts.iter().map(visibility).collect::<Images>());
        let variances = |times: &[f64]| {
            let sum = |images| moments(images, times).into_iter().map(|[_, variance]| variance).sum::<f64>();
            images.each_ref().map(|images| sum(images) / chosen.len() as f64)
        };
        let ratio = |[prev, ours]: [f64; 2]| prev / ours;
        let count = restarts[0].len();
        let measured = variances(&vec![1.0; count]);
        let resampled =
            (0..RESAMPLES_OF_VARIANCE).into_par_iter().map(|i| ratio(variances(&resample(i, count as u32)))).collect();
        let ratio = Interval::basic(ratio(measured), ratio(measured), resampled);
        Self { variances: measured, ratio, pixels: chosen.len() }
    }
}

/// One line of the tables.
struct Row {
    name: String,
    intervals: [Interval; STATISTICS.len()],
    reduction: Option<Reduction>,
    share_of_change: f64,
}

/// What believing neighbours within a radius does.
struct Near {
    radius: f32,
    /// Of the image's mean over that of the radius before, in percent.
    brighter: Interval,
    /// Rays for each pixel and frame.
    rays: f64,
}

/// What was measured.
struct Findings {
    /// Of each arrangement: white and coloured, each with and without visibility reuse, then coloured by channel.
    rows: Vec<Row>,
    near: Vec<Near>,
    /// Rays for each pixel and frame: by luminance, and by channel.
    rays: [f64; 2],
}

/// Claims about the method, and whether they hold here.
struct Claim {
    text: String,
    found: String,
    /// `None` if there are too few restarts to say.
    holds: Option<bool>,
    /// The command fails without it.
    required: bool,
}

impl Claim {
    fn inside(text: String, interval: Interval, low: f64, high: f64) -> Self {
        Self { text, found: interval.to_string(), holds: interval.inside(low, high), required: true }
    }

    fn verdict(&self) -> &'static str {
        match self.holds {
            Some(true) => "yes",
            Some(false) => "**no**",
            None => "undecided",
        }
    }
}

impl Findings {
    fn measure(restarts: u32) -> Self {
        let rows = ARRANGEMENTS.iter().flat_map(|arrangement| arrangement.measure(restarts)).collect();
        Self { rows, near: near(restarts), rays: rays() }
    }

    fn claims(&self) -> Vec<Claim> {
        let cost = self.rays[1] / self.rays[0];
        let cost = Claim {
            text: "a render for each channel costs 2.5 to 3.2 times the rays".to_owned(),
            found: format!("{cost:.3}"),
            holds: Some((2.5..3.2).contains(&cost)),
            required: true,
        };
        let near = self.near.iter().skip(1).map(|Near { radius, brighter, .. }| {
            let text = format!("neighbours nearer than {radius} pixels are believed: brighter again, in %");
            Claim::inside(text, *brighter, 0.0, f64::INFINITY)
        });
        ARRANGEMENTS.iter().flat_map(|arrangement| self.claims_of(arrangement)).chain([cost]).chain(near).collect()
    }

    fn claims_of(&self, arrangement: &Arrangement) -> Vec<Claim> {
        let row = |name: &str| {
            let name = arrangement.row(name);
            self.rows.iter().find(|row| row.name == name).expect("every arrangement has these rows")
        };
        let inside = |text: &str, interval, low, high| Claim::inside(arrangement.row(text), interval, low, high);
        let mut claims = Vec::new();
        for name in ["white", "coloured"] {
            let Row { intervals, reduction, .. } = row(name);
            let text = format!("{name}: the variance of visibility falls by 1.5 or more");
            claims.extend(reduction.iter().map(|reduction| inside(&text, reduction.ratio, 1.5, f64::INFINITY)));
            let darker =
                |(which, k)| inside(&format!("{name}: {which} is darker, in %"), intervals[k], f64::NEG_INFINITY, 0.0);
            claims.extend(["prev", "ours"].into_iter().zip(MEAN_ERRORS).map(darker));
        }
        for (name, low, high) in [("white", -0.1, 0.1), ("coloured", 0.0, 1.5), (BY_CHANNEL, -0.1, 0.1)] {
            let text = format!("{name}: the difference in RMSPE lies inside ({low}, {high}) points");
            let required = !(arrangement.adversarial && name == "coloured");
            claims.push(Claim { required, ..inside(&text, row(name).intervals[DIFFERENCE], low, high) });
        }
        let [with, without] = ["coloured", "coloured, occluded samples kept"].map(|name| row(name).intervals[DIRECT]);
        let smaller = inside("visibility reuse makes the leak smaller", with, 0.0, without.ends[0]);
        claims.push(Claim { found: format!("{with} with, {without} without"), ..smaller });
        let share = row("coloured").share_of_change;
        claims.push(Claim {
            text: arrangement.row("80 % of the absolute leak lie in part shadow"),
            found: format!("{:.1} %", 100.0 * share),
            holds: Some(share >= 0.8),
            required: true,
        });
        claims
    }

    fn report(&self, restarts: u32) -> String {
        let mut text = header(restarts) + "\n## Claims\n\n| claim | found | holds |\n|---|---|---|\n";
        text.extend(self.claims().iter().map(|claim| {
            let note = if claim.required { "" } else { " (not claimed)" };
            format!("| {} | {} | {}{note} |\n", claim.text, claim.found, claim.verdict())
        }));
        let columns = STATISTICS.join(" | ");
        let align = "---:|".repeat(STATISTICS.len());
        text += &format!("\n## Error\n\nRMSPE in percent.\n\n| lights | {columns} |\n|---|{align}\n");
        text.extend(self.rows.iter().map(|row| {
            let intervals = row.intervals.map(|interval| interval.to_string()).join(" | ");
            format!("| {} | {intervals} |\n", row.name)
        }));
        text += VARIANCE;
        text.extend(self.rows.iter().filter_map(|row| {
            let Reduction { variances: [prev, ours], ratio, pixels } = row.reduction.as_ref()?;
            Some(format!("| {} | {prev:.4} | {ours:.4} | {ratio} | {pixels} |\n", row.name))
        }));
        text += NEAR;
        text.extend(
            self.near.iter().map(|Near { radius, brighter, rays }| format!("| {radius} | {brighter} | {rays:.2} |\n")),
        );
        let [one, three] = self.rays;
        text + &format!(
            "\n## Cost\n\nRays for each pixel and frame, the camera's included: {one:.2}, in three renders of a channel each \
             {three:.2}. Averaging itself costs no ray.\n"
        )
    }
}

const VARIANCE: &str = "
## Variance of visibility

Of the visibility of a pixel's reservoir in the last frame, over the restarts; the mean over the pixels in part shadow.

| lights | prev | ours | ratio | pixels |
|---|---:|---:|---:|---:|
";

const NEAR: &str = "
## Near neighbours

Ours, with neighbours nearer than some pixels believed to see the same, which saves their rays: how much brighter the
image is than that of the line before, in percent; the white row of lights, with the same seeds.

| pixels | brighter | rays a pixel |
|---:|---:|---:|
";

fn header(restarts: u32) -> String {
    let DiSettings { candidates, radius, confidence_cap, neighbours, .. } = settings(Visibility::Averaged);
    let [frames, from] = FRAMES;
    let samples = BATCHES * REFERENCE_SAMPLES;
    format!(
        "# Averaged visibility

Reuse of visibility in ReSTIR DI: that of the selected sample (Wyman and Panteleev 2021, \"prev\") and the weighted mean
over all samples that competed (Tokuyoshi, \"ours\"), with the same seeds, against path tracing of one bounce with {samples}
samples a pixel (\"ref\").

A wall of {SIZE} x {SIZE} pixels is lit past a board by {ROW} lights in two arrangements; nothing moves.

* **spread** is what the claims about colour are about: the flat experiment of Tokuyoshi's figures, with both directions of the wall as its one direction there. Point lights stand up to 3 from the middle of a
  wall 4 wide and 1.5 to 3 before it, a board of 1.1 x 1.1 is 0.7 before it. Places, intensities (0.5 to 4) and hues
  (three uniform numbers to the 4th power, over the largest) are random and unrelated, by one fixed seed, {ROW}, the number of
  lights; no other was tried. White lights have the same places and intensities.
* **row** is made to be as bad as can be for colour: small square lights in a row, in the order of their hues, from red by way of
  green to blue, so that where a shadow lies says which colour is missing. The bound on the leak is not claimed for it; what
  it misses is in the table.

Settings of all: preset `wis` with {candidates} candidates, no candidate from scattering, temporal
reuse up to {confidence_cap} frames, {neighbours} neighbour within {radius} pixels. A restart has {frames} frames, the mean
of those from the {from}th on (counted from 0) is its image; there are {restarts} restarts. `visibility_reuse` is candidates, as
in Tokuyoshi's algorithm 1, but for the rows \"occluded samples kept\". In \"a render for each channel\", both are
three renders, whose samples are selected by one channel each (`target=red`...). What prev converges to does not depend on
that: all surfaces are grey, so that a light's sample has the same MIS weights by every channel.

RMSPE runs over all channels of all pixels. It is corrected for noise: the variances of the mean images, of the restarts
and of the reference, are taken off the squared errors; a sum that is below zero then is shown as a negative RMSPE. Brackets
hold 95 % intervals, basic bootstrap over {BATCHES} batches of restarts and of the reference ({RESAMPLES} resamples), of
the variance over single restarts. Where the error itself is within the noise (occluded samples kept, white), the interval of
an RMSPE is not to be relied on; those of the mean error are.

Made by `cargo lab visibility --write`. That sample, weight and confidence are the same bits with and without the
averaging, that the mean is the weighted one, which rays are traced, that static white light is unbiased and how far
shadows lag is tested by `cargo test --release --test techniques restir_di_visibility::`.
"
    )
}

impl Arrangement {
    fn row(&self, name: &str) -> String {
        format!("{}, {name}", self.name)
    }

    fn measure(&self, restarts: u32) -> Vec<Row> {
        let mut rows = Vec::new();
        for hues in ["white", "coloured"] {
            let buffers = (self.buffers)(hues == "coloured");
            let reference = reference(&buffers);
            eprintln!("{}: reference", self.row(hues));
            let row = |name: &str, images, reduction, partial: &[bool]| {
                eprintln!("{}", self.row(name));
                let comparison = Comparison::new(images, reference.clone());
                let (intervals, share_of_change) = (comparison.intervals(), comparison.share_of_change(partial));
                Row { name: self.row(name), intervals, reduction, share_of_change }
            };
            let mut partial = Vec::new();
            // those that keep what is occluded know how much of the light each pixel sees
            for (note, visibility_reuse) in
                [(", occluded samples kept", VisibilityReuse::Off), ("", VisibilityReuse::Candidates)]
            {
                let [prev, ours] = METHODS.map(|visibility| {
                    of_size(DiSettings { visibility_reuse, ..settings(visibility) }).restarts(&buffers, restarts)
                });
                if visibility_reuse == VisibilityReuse::Off {
                    partial = visibility_moments(&prev).iter().map(|v| PARTIAL.contains(&v.mean())).collect();
                }
                let reduction = Reduction::new([&prev, &ours], &partial);
                let images = [batches(&prev), batches(&ours)];
                rows.push(row(&format!("{hues}{note}"), images, Some(reduction), &partial));
            }
            if hues == "coloured" {
                let images = METHODS.map(|visibility| by_channel(&buffers, visibility, restarts));
                rows.push(row(BY_CHANNEL, images, None, &partial));
            }
        }
        rows
    }
}

/// Images of which each channel has a render of its own.
fn by_channel(buffers: &SceneBuffers, visibility: Visibility, restarts: u32) -> Images {
    let channels = CHANNELS.map(|target| {
        eprintln!("{}", target.name());
        batches(&of_size(DiSettings { target, ..settings(visibility) }).restarts(buffers, restarts))
    });
    let batch = |b: usize| (0..channels[0][b].len()).map(|i| channels[i % 3][b][i]).collect();
    (0..BATCHES as usize).map(batch).collect()
}

/// Believing neighbours within growing radii, in the white row of lights: the restarts share their seeds.
fn near(restarts: u32) -> Vec<Near> {
    let buffers = penumbra(white).buffers();
    let of_radius = |near_radius| DiSettings { near_radius, ..settings(Visibility::Averaged) };
    let means = |near_radius| -> Vec<f64> {
        eprintln!("near neighbours: {near_radius}");
        let restarts = of_size(of_radius(near_radius)).restarts(&buffers, restarts);
        restarts.iter().map(|restart| restart.image.iter().flatten().sum()).collect()
    };
    let means = NEAR_RADII.map(means);
    let of_index = |i: usize| {
        let (before, after) = (&means[i.saturating_sub(1)], &means[i]);
        let brighter = |times: &[f64]| {
            let sum = |means: &[f64]| means.iter().zip(times).map(|(mean, times)| mean * times).sum::<f64>();
            100.0 * (sum(after) / sum(before) - 1.0)
        };
        let value = brighter(&vec![1.0; after.len()]);
        let resampled = (0..RESAMPLES).map(|i| brighter(&resample(i, restarts))).collect();
        let rays = rays_of(&buffers, of_radius(NEAR_RADII[i]));
        Near { radius: NEAR_RADII[i], brighter: Interval::basic(value, value, resampled), rays }
    };
    (0..NEAR_RADII.len()).map(of_index).collect()
}

/// Rays for each pixel and frame.
fn rays_of(buffers: &SceneBuffers, settings: DiSettings) -> f64 {
    let [frames, side] = COUNTED;
    let view = buffers.view();
    let run = Run { size: [side; 2], frames, from: 0, settings };
    let recording = Recording::new(&view);
    let render = run.render(0);
    CpuExecutor::run_over(&Still(&recording), render.plan(buffers)).expect("a still scene is replayed");
    recording.counts().rays() as f64 / f64::from(frames * side * side)
}

/// By luminance and summed over the channels.
fn rays() -> [f64; 2] {
    let buffers = penumbra(coloured).buffers();
    let of = |target| rays_of(&buffers, DiSettings { target, ..settings(Visibility::Averaged) });
    [of(Target::Luminance), CHANNELS.map(of).iter().sum()]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noisy images of a known error, where the noise alone would be an RMSPE of 5 %.
    #[test]
    fn noise_is_taken_off_and_intervals_hold_the_truth() {
        let mut random = SplitMix::new(5);
        let mut images = |mean: f64| -> Images {
            (0..BATCHES).map(|_| (0..600).map(|_| mean * (1.0 + 1.4 * (random.unit() - 0.5))).collect()).collect()
        };
        let intervals = Comparison::new([images(0.9), images(0.88)], images(1.0)).intervals();
        for (interval, truth) in intervals.iter().zip([10.0, 12.0, 2.0, 2.0, -10.0, -12.0]) {
            assert_eq!(interval.inside(truth - 1.5, truth + 1.5), Some(true), "{interval} for {truth}");
            assert!(interval.ends[0] - 0.3 < truth && truth < interval.ends[1] + 0.3, "{interval} for {truth}");
        }
    }
}
