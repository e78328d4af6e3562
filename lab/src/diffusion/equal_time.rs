//! What methods cost: time and variance of each part and choice, errors at few samples, and when the walk overtakes.

use std::fmt::Write as _;

use glam::DVec3;
use rayon::prelude::*;
use restir_cli::trial::squared_difference;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::Camera;
use restir_host::settings::Choice as _;
use restir_host::technique::path::{Crossings, Parts, PathSettings, RadiusChoice, Subsurface, WayOut};

use super::pictures::{Interval, Pictures, RUNS, SIZE, image, root};
use super::{MEDIA, filled, settings};
use crate::Error;

/// Samples of pictures whose errors are shown.
const SPP: [u32; 3] = [1, 4, 16];
/// Pairs of pictures a run of which a variance is.
const PAIRS: u32 = 6;
/// Turns of a run, and samples of a turn, where times alone are compared.
const TURNS: u32 = 6;
const TURN: u32 = 16;
/// Of [`methods`], those that are whole.
const WALK: usize = 0;
const WHOLE: [usize; 3] = [WALK, 1, 2];

fn methods() -> Vec<(&'static str, PathSettings)> {
    let hybrid = settings(Subsurface::Hybrid);
    let part = |parts| PathSettings { parts, ..hybrid.clone() };
    vec![
        ("walk", settings(Subsurface::Walk)),
        ("hybrid", hybrid.clone()),
        ("diffusion", settings(Subsurface::Diffusion)),
        ("of the hybrid: what enters no body", part(Parts::Rest)),
        ("boundary term", part(Parts::Boundary)),
        ("single scattering", part(Parts::Single)),
        ("profile", part(Parts::Profile)),
        ("hybrid, 1 segment", PathSettings { segments: 1, ..hybrid.clone() }),
        ("4 segments", PathSettings { segments: 4, ..hybrid.clone() }),
        ("light samples alone", PathSettings { profile_paths: false, ..hybrid.clone() }),
        ("one crossing of a segment", PathSettings { crossings: Crossings::One, ..hybrid.clone() }),
        ("radii by the albedo", PathSettings { radius_channel: RadiusChoice::Albedo, ..hybrid.clone() }),
        ("way out drawn", PathSettings { way_out: WayOut::Drawn, ..hybrid.clone() }),
        ("single scattering, way out drawn", PathSettings { way_out: WayOut::Drawn, ..part(Parts::Single) }),
    ]
}

/// The variance of a pixel's sample and the milliseconds of a sample of the picture, by run.
#[derive(Default)]
struct Cost {
    variance: Vec<f64>,
    milliseconds: Vec<f64>,
}

impl Cost {
    fn product(&self, runs: &[usize]) -> f64 {
        mean(&self.variance, runs) * mean(&self.milliseconds, runs)
    }

    /// Times and variances of all methods, which take turns.
    fn of(scene: &SceneBuffers, methods: &[(&str, PathSettings)]) -> Result<Vec<Self>, Error> {
        let mut costs: Vec<Self> = methods.iter().map(|_| Self::default()).collect();
        for run in 0..RUNS as u32 {
            for (cost, (_, settings)) in costs.iter_mut().zip(methods) {
                let (mut variance, mut time) = (0.0, 0.0);
                for pair in 0..PAIRS {
                    let seed = 2 * (run * PAIRS + pair);
                    let [(a, of_a), (b, of_b)] =
                        [image(scene, settings, SIZE, 1, seed)?, image(scene, settings, SIZE, 1, seed + 1)?];
                    variance += 0.5 * squared(&a, &b) / f64::from(PAIRS);
                    time += (of_a + of_b) / f64::from(2 * PAIRS);
                }
                cost.variance.push(variance);
                cost.milliseconds.push(1000.0 * time);
            }
        }
        Ok(costs)
    }
}

fn mean(values: &[f64], runs: &[usize]) -> f64 {
    runs.iter().map(|&run| values[run]).sum::<f64>() / runs.len() as f64
}

fn squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / a.len() as f64
}

/// A reference, and the part of squared differences from it that is its own noise.
struct Reference {
    values: Vec<f64>,
    noise: f64,
}

impl Reference {
    fn new(walk: &Pictures) -> Self {
        let all: Vec<usize> = (0..RUNS).collect();
        let values: Vec<f64> = (0..walk.runs[0].len())
            .map(|i| all.iter().map(|&run| walk.runs[run][i]).sum::<f64>() / RUNS as f64)
            .collect();
        let about: f64 = walk.runs.iter().map(|run| squared(run, &values)).sum();
        Self { noise: about / (RUNS * (RUNS - 1)) as f64, values }
    }
}

/// The root of the mean squared error at [`SPP`] samples a pixel.
fn at_few(scene: &SceneBuffers, settings: &PathSettings, reference: &Reference) -> Result<[Interval; 3], Error> {
    let mut errors = Vec::new();
    for spp in SPP {
        let off = |run: usize| -> Result<f64, Error> {
            let (found, _) = image(scene, settings, SIZE, spp, 1000 + run as u32)?;
            Ok(squared(&found, &reference.values) - reference.noise)
        };
        let squares = (0..RUNS).map(off).collect::<Result<Vec<_>, _>>()?;
        errors.push(Interval::of(|runs| root(mean(&squares, runs))));
    }
    Ok([errors[0], errors[1], errors[2]])
}

/// The tables of one medium: whole methods, what is said of them, and all methods.
struct Tables {
    whole: String,
    said: String,
    all: String,
}

fn tables(medium: &str, scale: f64, samples: u32) -> Result<Tables, Error> {
    let (scene, methods) = (filled("statue", medium, scale)?, methods());
    let converged = |index: usize| Pictures::of(&scene, &methods[index].1, SIZE, samples, 100 + index as u32);
    let walk = converged(WALK)?;
    let reference = Reference::new(&walk);
    let costs = Cost::of(&scene, &methods)?;
    let (mut whole, mut said) = (String::new(), String::new());
    for index in WHOLE {
        let (name, settings) = &methods[index];
        let [one, four, sixteen] = at_few(&scene, settings, &reference)?;
        let milliseconds = Interval::of(|runs| mean(&costs[index].milliseconds, runs));
        let _ =
            write!(whole, "| {medium}:{scale} | {name} | {milliseconds:.2} | {one:.4} | {four:.4} | {sixteen:.4} |");
        if index == WALK {
            let _ = writeln!(whole, " 0 |");
            continue;
        }
        let other = converged(index)?;
        let bias = |runs: &[usize]| squared_difference(&other.runs, &walk.runs, runs);
        let _ = writeln!(whole, " {:.4} |", Interval::of(|runs| root(bias(runs))));
        let _ = writeln!(said, "* {medium}:{scale}, {name}: {}.", overtaking(&costs[WALK], &costs[index], bias));
    }
    let mut all = format!(
        "\n| statue of {medium}:{scale} | variance | ms | product | the walk's over it |\n|---|---:|---:|---:|---:|\n"
    );
    for ((name, _), cost) in methods.iter().zip(&costs) {
        let [variance, milliseconds] =
            [&cost.variance, &cost.milliseconds].map(|values| Interval::of(|runs| mean(values, runs)));
        let product = Interval::of(|runs| cost.product(runs));
        let gain = gain(&costs[WALK], cost);
        let _ = writeln!(all, "| {name} | {variance:.4} | {milliseconds:.2} | {product:.3} | {gain:.2} |");
    }
    Ok(Tables { whole, said, all })
}

/// How many times the variance of a method the walk's is at equal time.
fn gain(walk: &Cost, other: &Cost) -> Interval {
    Interval::of(|runs| walk.product(runs) / other.product(runs))
}

/// What the walk's variance is at equal time, and when what stays of the other method's error is more than it.
fn overtaking(walk: &Cost, other: &Cost, bias: impl Fn(&[usize]) -> f64) -> String {
    let gain = gain(walk, other);
    let lead = |runs: &[usize]| 1.0e-3 * (walk.product(runs) - other.product(runs)) / bias(runs);
    let of_walk = |runs: &[usize]| 1.0e3 * lead(runs) / mean(&walk.milliseconds, runs);
    let after = match Interval::of(|runs| walk.product(runs) - other.product(runs)).is_positive() {
        Some(true) => format!(
            "the walk overtakes after {:.2} s, {:.0} of its samples a pixel",
            Interval::of(lead),
            Interval::of(of_walk)
        ),
        Some(false) => "the walk is ahead from the beginning".to_owned(),
        None => "which of both is ahead at the beginning is not decided".to_owned(),
    };
    format!("at equal time the variance of the walk is {gain:.2} times as large; {after}")
}

/// The sections of the report.
pub(super) fn report(samples: u32) -> Result<String, Error> {
    let tables =
        MEDIA.par_iter().map(|&(medium, scale)| tables(medium, scale, samples)).collect::<Result<Vec<_>, _>>()?;
    let joined = |of: fn(&Tables) -> &str| tables.iter().map(of).collect::<String>();
    Ok(format!(
        "\n## At equal time\n\nTime is the processor's, of one thread, for a sample of each pixel; errors are roots of the mean squared error against a converged walk, without \
         the noise of that. What stays is the same of as many samples as there are, less the noise of both. Intervals are of 95 %, of {RUNS} runs by other random numbers (jackknife); methods take turns, \
         a run of one after a run of another.\n\n| statue of | method | ms a sample | RMSE at 1 | at 4 | at 16 | what stays |\n|---|---|---:|---:|---:|---:|---:|\n{}\n\
         Of the times and variances of the next section:\n\n{}\n\
         ## Where the variance comes from\n\nThe variance of a pixel's sample, the processor's milliseconds of a sample of the picture, and their product, which is the variance at equal time; the walk's product over it. Of \
         the whole, of each part, and of other choices.\n{}",
        joined(|tables| &tables.whole),
        joined(|tables| &tables.said),
        joined(|tables| &tables.all),
    ))
}

/// What bodies cost that are not in the picture.
pub(super) fn elsewhere() -> Result<String, Error> {
    let mut text = format!(
        "\n## Where no body is seen\n\nThe statue of wax, and a camera that looks at the floor beside it: the processor's milliseconds of a sample of the picture, and how much more than with \
        `subsurface=off`. Methods take turns, of {TURN} samples each.\n\n| method | ms | more than without |\n|---|---:|---:|\n"
    );
    let mut scene = filled("statue", "wax", 0.02)?;
    scene.camera =
        Camera::pinhole(DVec3::new(3.0, 2.0, 3.0), DVec3::new(4.0, 0.0, 4.0), DVec3::Y, 40.0_f64.to_radians());
    let methods = [Subsurface::Off, Subsurface::Hybrid, Subsurface::Walk]
        .map(|subsurface| (subsurface.name(), settings(subsurface)));
    let mut milliseconds = [const { Vec::new() }; 3];
    for run in 0..RUNS as u32 {
        let mut sums = [0.0; 3];
        for turn in 0..TURNS {
            for (sum, (_, settings)) in sums.iter_mut().zip(&methods) {
                let (_, time) = image(&scene, settings, SIZE, TURN, run * TURNS + turn)?;
                *sum += 1000.0 * time / f64::from(TURNS * TURN);
            }
        }
        milliseconds.iter_mut().zip(sums).for_each(|(of, sum)| of.push(sum));
    }
    for ((name, _), of) in methods.iter().zip(&milliseconds) {
        let more = Interval::of(|runs| mean(of, runs) / mean(&milliseconds[0], runs) - 1.0);
        let of = Interval::of(|runs| mean(of, runs));
        let _ = writeln!(text, "| {name} | {of:.2} | {} |", more.percent());
    }
    Ok(text)
}
