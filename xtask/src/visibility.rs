//! `cargo xtask visibility`: averaged visibility (Tokuyoshi) against that of the selected sample, in error and variance,
//! and the report of it.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use clap::Args;
use rayon::prelude::*;
use restir_host::bootstrap::Interval;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::replay::Recording;
use restir_host::technique::restir_di::{DiSettings, Target, Visibility, VisibilityReuse};
use restir_shared::scene::Still;
use restir_shared::technique::path;
use restir_shared::technique::path::PathParams;
use restir_tests::random::SplitMix;
use restir_tests::scenes::{ROW, coloured, penumbra, spread, white};
use restir_tests::stats::Moments;
use restir_tests::visibility::{Restart, Run, settings, visibility_moments};

use crate::{Error, num};

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

/// Options of `cargo xtask visibility`.
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
    let report = findings.report(restarts);
    println!("{report}");
    eprintln!("{:.0} s", start.elapsed().as_secs_f64());
    if options.write {
        num::write(&Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("docs").join("visibility.md"), &report)?;
    }
    let failed: Vec<_> =
        findings.claims().into_iter().filter(|c| c.required && c.holds != Some(true)).map(|c| c.text).collect();
    if failed.is_empty() { Ok(()) } else { Err(Error::Failed(format!("not shown: {}", failed.join("; ")))) }
}

/// Independent images of the same expectation, all values of a picture each.
type Images = Vec<Vec<f64>>;

/// A mean image and the variance of each of its values.
struct Estimate {
    mean: Vec<f64>,
    variance: Vec<f64>,
}

impl Estimate {
    /// Of images that count `times` each.
    fn new(images: &Images, times: &[f64]) -> Self {
        let count: f64 = times.iter().sum();
        let values = images[0].len();
        let (mut mean, mut variance) = (vec![0.0; values], vec![0.0; values]);
        for (image, times) in images.iter().zip(times) {
            mean.iter_mut().zip(image).for_each(|(mean, x)| *mean += times * x / count);
        }
        for (image, times) in images.iter().zip(times) {
            for ((variance, x), mean) in variance.iter_mut().zip(image).zip(&mean) {
                *variance += times * (x - mean).powi(2) / (count * (count - 1.0));
            }
        }
        Self { mean, variance }
    }

    /// As if the mean were the truth.
    fn without_noise(self) -> Self {
        Self { variance: vec![0.0; self.mean.len()], ..self }
    }
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
    fn new(prev: Images, ours: Images, reference: Images) -> Self {
        let change = ours.iter().zip(&prev).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect()).collect();
        let mean = Estimate::new(&reference, &vec![1.0; reference.len()]).mean;
        let dark = DARK * mean.iter().sum::<f64>() / mean.len() as f64;
        Self { prev, ours, change, counts: mean.iter().map(|&r| r > dark).collect(), reference }
    }

    fn estimates(&self, times: &[f64], reference_times: &[f64]) -> [Estimate; 4] {
        [
            Estimate::new(&self.prev, times),
            Estimate::new(&self.ours, times),
            Estimate::new(&self.change, times),
            Estimate::new(&self.reference, reference_times),
        ]
    }

    /// Noise-corrected: what the estimates' own variances add to squared errors is taken off.
    fn statistics(&self, [prev, ours, change, reference]: &[Estimate; 4]) -> [f64; STATISTICS.len()] {
        let mut squares = [0.0; 3];
        let mut sums = [0.0; 3];
        let mut count = 0.0;
        for i in (0..self.counts.len()).filter(|&i| self.counts[i]) {
            let r = reference.mean[i];
            let off = |x: &Estimate| (x.mean[i] - r).powi(2) - x.variance[i] - reference.variance[i];
            let terms = [off(prev), off(ours), change.mean[i].powi(2) - change.variance[i]];
            squares.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term / (r * r));
            sums.iter_mut().zip([r, prev.mean[i], ours.mean[i]]).for_each(|(sum, x)| *sum += x);
            count += 1.0;
        }
        // a square that noise took below zero stays visible as such
        let percent = |square: f64| 100.0 * (square.abs() / count).sqrt().copysign(square);
        let [a, b, direct] = squares.map(percent);
        let [r, p, o] = sums;
        [a, b, b - a, direct, 100.0 * (p / r - 1.0), 100.0 * (o / r - 1.0)]
    }

    fn intervals(&self) -> [Interval; STATISTICS.len()] {
        let once = vec![1.0; BATCHES as usize];
        let values = self.statistics(&self.estimates(&once, &once));
        let centers = self.statistics(&self.estimates(&once, &once).map(Estimate::without_noise));
        let resampled: Vec<_> = (0..RESAMPLES)
            .into_par_iter()
            .map(|i| self.statistics(&self.estimates(&resample(2 * i, BATCHES), &resample(2 * i + 1, BATCHES))))
            .collect();
        std::array::from_fn(|k| Interval::basic(values[k], centers[k], resampled.iter().map(|all| all[k]).collect()))
    }

    /// The part of the absolute change, relative to the reference, that lies in the given pixels. Noise alone would count
    /// for zero: each half of the restarts says which sign the other half's change should have.
    fn share_of_change(&self, pixels: &[bool]) -> f64 {
        let every_other = |first: usize| {
            let times: Vec<f64> = (0..self.change.len()).map(|i| f64::from(u8::from(i % 2 == first))).collect();
            Estimate::new(&self.change, &times).mean
        };
        let [a, b] = [every_other(0), every_other(1)];
        let reference = Estimate::new(&self.reference, &vec![1.0; self.reference.len()]).mean;
        let term = |i: usize| (a[i].signum() * b[i] + b[i].signum() * a[i]) / reference[i];
        let all = (0..self.counts.len()).filter(|&i| self.counts[i]);
        let (inside, sum) = all
            .fold((0.0, 0.0), |(inside, sum), i| (inside + if pixels[i / 3] { term(i) } else { 0.0 }, sum + term(i)));
        inside / sum
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
    let size = restarts.len() / BATCHES as usize;
    let mean = |batch: &[Restart]| {
        let mut sum = vec![0.0; 3 * batch[0].image.len()];
        for restart in batch {
            sum.iter_mut().zip(restart.image.as_flattened()).for_each(|(sum, x)| *sum += x / size as f64);
        }
        sum
    };
    restarts.chunks(size).map(mean).collect()
}

/// Of path tracing with one bounce.
fn reference(buffers: &SceneBuffers) -> Images {
    let view = buffers.view();
    let camera = buffers.camera.params(SIZE, SIZE);
    let params =
        PathParams { scene: buffers.header, camera, width: SIZE, height: SIZE, max_depth: 2, ..PathParams::default() };
    let pixel = |batch: u32, i: u32| {
        let first = batch * REFERENCE_SAMPLES;
        let sum = (first..first + REFERENCE_SAMPLES).fold([0.0; 3], |sum: [f64; 3], seed| {
            let sample = path::pixel(&view, &PathParams { seed, ..params }, i % SIZE, i / SIZE).sum;
            std::array::from_fn(|channel| sum[channel] + f64::from(sample[channel]))
        });
        sum.map(|sum| sum / f64::from(REFERENCE_SAMPLES))
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
    fn new([prev, ours]: [&[Restart]; 2], pixels: &[bool]) -> Self {
        let chosen: Vec<usize> = (0..pixels.len()).filter(|&i| pixels[i]).collect();
        let variance = |restarts: &[Restart], times: &[f64]| {
            let of_pixel = |&i: &usize| {
                let (mut sum, mut squares) = (0.0, 0.0);
                for (restart, times) in restarts.iter().zip(times) {
                    let v = f64::from(restart.visibility[i]);
                    (sum, squares) = (sum + times * v, squares + times * v * v);
                }
                let count = restarts.len() as f64;
                (squares - sum * sum / count) / (count - 1.0)
            };
            chosen.iter().map(of_pixel).sum::<f64>() / chosen.len() as f64
        };
        let count = prev.len() as u32;
        let of = |times: &[f64]| [variance(prev, times), variance(ours, times)];
        let variances = of(&vec![1.0; prev.len()]);
        let resampled: Vec<f64> = (0..RESAMPLES_OF_VARIANCE)
            .into_par_iter()
            .map(|i| of(&resample(i, count)))
            .map(|[prev, ours]| prev / ours)
            .collect();
        let ratio = variances[0] / variances[1];
        Self { variances, ratio: Interval::basic(ratio, ratio, resampled), pixels: chosen.len() }
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

impl Findings {
    fn measure(restarts: u32) -> Self {
        let rows = ARRANGEMENTS.iter().flat_map(|arrangement| arrangement.measure(restarts)).collect();
        Self { rows, near: near(restarts), rays: rays() }
    }

    fn row(&self, arrangement: &Arrangement, name: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.name == arrangement.row(name))
    }

    fn claims(&self) -> Vec<Claim> {
        let mut claims: Vec<Claim> = ARRANGEMENTS.iter().flat_map(|arrangement| self.claims_of(arrangement)).collect();
        let mut claim = |text: &str, found, holds| {
            claims.push(Claim { text: text.to_owned(), found, holds, required: true });
        };
        let cost = self.rays[1] / self.rays[0];
        claim(
            "a render for each channel costs 2.5 to 3.2 times the rays",
            format!("{cost:.3}"),
            Some((2.5..3.2).contains(&cost)),
        );
        for Near { radius, brighter, .. } in self.near.iter().skip(1) {
            let text = format!("neighbours nearer than {radius} pixels are believed: brighter again, in %");
            claim(&text, brighter.to_string(), brighter.inside(0.0, f64::INFINITY));
        }
        claims
    }

    fn claims_of(&self, arrangement: &Arrangement) -> Vec<Claim> {
        let mut claims = Vec::new();
        let mut claim = |text: String, found: String, holds, required| {
            claims.push(Claim { text: format!("{}, {text}", arrangement.name), found, holds, required });
        };
        for name in ["white", "coloured"] {
            let Some(row) = self.row(arrangement, name) else { continue };
            if let Some(Reduction { ratio, .. }) = &row.reduction {
                let holds = ratio.inside(1.5, f64::INFINITY);
                claim(
                    format!("{name}: the variance of visibility falls by 1.5 or more"),
                    ratio.to_string(),
                    holds,
                    true,
                );
            }
            for (which, k) in ["prev", "ours"].into_iter().zip(MEAN_ERRORS) {
                let error = row.intervals[k];
                let holds = error.inside(f64::NEG_INFINITY, 0.0);
                claim(format!("{name}: {which} is darker, in %"), error.to_string(), holds, true);
            }
        }
        for (name, low, high) in [("white", -0.1, 0.1), ("coloured", 0.0, 1.5), (BY_CHANNEL, -0.1, 0.1)] {
            let Some(row) = self.row(arrangement, name) else { continue };
            let difference = row.intervals[DIFFERENCE];
            let text = format!("{name}: the difference in RMSPE lies inside ({low}, {high}) points");
            let required = !(arrangement.adversarial && name == "coloured");
            claim(text, difference.to_string(), difference.inside(low, high), required);
        }
        let direct = |name| self.row(arrangement, name).map(|row| row.intervals[DIRECT]);
        if let (Some(with), Some(without)) = (direct("coloured"), direct("coloured, occluded samples kept")) {
            let found = format!("{with} with, {without} without");
            claim("visibility reuse makes the leak smaller".to_owned(), found, with.inside(0.0, without.ends[0]), true);
        }
        if let Some(row) = self.row(arrangement, "coloured") {
            let found = format!("{:.1} %", 100.0 * row.share_of_change);
            let holds = Some(row.share_of_change >= 0.8);
            claim("80 % of the absolute leak lie in part shadow".to_owned(), found, holds, true);
        }
        claims
    }

    fn report(&self, restarts: u32) -> String {
        let mut text = header(restarts);
        let _ = write!(text, "\n## Claims\n\n| claim | found | holds |\n|---|---|---|\n");
        for Claim { text: claim, found, holds, required } in self.claims() {
            let note = if required { "" } else { " (not claimed)" };
            let _ = writeln!(text, "| {claim} | {found} | {}{note} |", verdict(holds));
        }
        let _ = write!(text, "\n## Error\n\nRMSPE in percent.\n\n| lights |");
        STATISTICS.iter().for_each(|name| text += &format!(" {name} |"));
        text += "\n|---|";
        STATISTICS.iter().for_each(|_| text += "---:|");
        for row in &self.rows {
            let _ = write!(text, "\n| {} |", row.name);
            row.intervals.iter().for_each(|interval| text += &format!(" {interval} |"));
        }
        text += VARIANCE;
        for (row, reduction) in self.rows.iter().filter_map(|row| Some((row, row.reduction.as_ref()?))) {
            let Reduction { variances: [prev, ours], ratio, pixels } = reduction;
            let _ = writeln!(text, "| {} | {prev:.4} | {ours:.4} | {ratio} | {pixels} |", row.name);
        }
        text += NEAR;
        for Near { radius, brighter, rays } in &self.near {
            let _ = writeln!(text, "| {radius} | {brighter} | {rays:.2} |");
        }
        let [one, three] = self.rays;
        let _ = write!(
            text,
            "\n## Cost\n\nRays for each pixel and frame, the camera's included: {one:.2}, in three renders of a channel each \
             {three:.2}. Averaging itself costs no ray.\n"
        );
        text
    }
}

fn verdict(holds: Option<bool>) -> &'static str {
    match holds {
        Some(true) => "yes",
        Some(false) => "**no**",
        None => "undecided",
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

* **spread** is what the claims about colour are about: the flat experiment of Tokuyoshi's figures in our specification
  (appendix A4), with both directions of the wall as its one direction there. Point lights stand up to 3 from the middle of a
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

Made by `cargo xtask visibility --write`. That sample, weight and confidence are the same bits with and without the
averaging, that the mean is the weighted one, which rays are traced, that static white light is unbiased and how far
shadows lag is tested by `cargo test --test restir_di_visibility`.
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
            let mut partial = Vec::new();
            // those that keep what is occluded know how much of the light each pixel sees
            for (name, visibility_reuse) in [
                (format!("{hues}, occluded samples kept"), VisibilityReuse::Off),
                (hues.to_owned(), VisibilityReuse::Candidates),
            ] {
                let [prev, ours] = [Visibility::Selected, Visibility::Averaged].map(|visibility| {
                    of_size(DiSettings { visibility_reuse, ..settings(visibility) }).restarts(&buffers, restarts)
                });
                eprintln!("{}", self.row(&name));
                if visibility_reuse == VisibilityReuse::Off {
                    partial =
                        visibility_moments(&prev).iter().map(Moments::mean).map(|v| PARTIAL.contains(&v)).collect();
                }
                let comparison = Comparison::new(batches(&prev), batches(&ours), reference.clone());
                rows.push(Row {
                    name: self.row(&name),
                    intervals: comparison.intervals(),
                    reduction: Some(Reduction::new([&prev, &ours], &partial)),
                    share_of_change: comparison.share_of_change(&partial),
                });
            }
            if hues == "coloured" {
                let [prev, ours] = [Visibility::Selected, Visibility::Averaged]
                    .map(|visibility| by_channel(&buffers, visibility, restarts));
                let comparison = Comparison::new(prev, ours, reference);
                rows.push(Row {
                    name: self.row(BY_CHANNEL),
                    intervals: comparison.intervals(),
                    reduction: None,
                    share_of_change: comparison.share_of_change(&partial),
                });
            }
        }
        rows
    }
}

/// Images of which each channel has a render of its own.
fn by_channel(buffers: &SceneBuffers, visibility: Visibility, restarts: u32) -> Images {
    let channels = [Target::Red, Target::Green, Target::Blue].map(|target| {
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
    CpuExecutor::run_over(&Still(&recording), render.technique.plan(buffers, &render), &mut |_| Ok(()))
        .expect("a still scene is replayed");
    recording.counts().rays() as f64 / f64::from(frames * side * side)
}

/// By luminance and summed over the channels.
fn rays() -> [f64; 2] {
    let buffers = penumbra(coloured).buffers();
    let of = |target| rays_of(&buffers, DiSettings { target, ..settings(Visibility::Averaged) });
    [of(Target::Luminance), [Target::Red, Target::Green, Target::Blue].map(of).iter().sum()]
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
        let comparison = Comparison::new(images(0.9), images(0.88), images(1.0));
        let intervals = comparison.intervals();
        for (interval, truth) in intervals.iter().zip([10.0, 12.0, 2.0, 2.0, -10.0, -12.0]) {
            assert_eq!(interval.inside(truth - 1.5, truth + 1.5), Some(true), "{interval} for {truth}");
            assert!(interval.ends[0] - 0.3 < truth && truth < interval.ends[1] + 0.3, "{interval} for {truth}");
        }
    }
}
