//! Error against run time: scenes x techniques x samples a pixel, with independent restarts.
//!
//! `measure` gives the runs of one scene, `table` makes a row of each, and all that is published (CSV, plots,
//! report, the comparison with an older report) is made of these rows or of `SceneResult`.

pub(crate) mod against;
mod command;
mod equal_time;
pub(crate) mod error;
pub(crate) mod estimator;
pub(crate) mod fit;
#[cfg(test)]
mod noise;
pub(crate) mod plot;
pub(crate) mod report;
pub(crate) mod table;
pub(crate) mod timed;

pub use command::{Arguments, run};
pub(crate) use command::{REPORT, check_output, setup, write_text};

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use restir::advanced::reference::Picture;
use restir::render::{Progress, Render};
use restir::{Error, buffers::SceneBuffers, exec::Executor};

use restir_cli::candidate::Candidate;

use error::{Errors, Figure, Truth};
use estimator::{PerSample, per_sample};
use timed::{PassTime, Timed};

/// However little time there is, this many restarts are made: fewer have no spread.
const FEWEST_RESTARTS: u32 = 2;

/// What to measure on every scene.
#[derive(Clone, Debug)]
pub(crate) struct Matrix {
    /// What all techniques have in common.
    pub(crate) picture: Picture,
    /// Their size and integral are the picture's; count and seed do not matter. A frame is a sample.
    pub(crate) techniques: Vec<Candidate>,
    /// Samples a pixel, ascending.
    pub(crate) budgets: Vec<u32>,
    /// Each takes about equal time for every number of samples.
    pub(crate) restarts: u32,
    /// No restart after the second begins later than this.
    pub(crate) time: Duration,
}

/// A restart: images with seeds of their own, as many as together have the samples of the largest budget, so that the
/// errors of all budgets are known equally well.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// The first image's seed; the others' follow.
    pub(crate) seed: u32,
    pub(crate) images: u32,
    /// The median over the images.
    pub(crate) seconds: f64,
    /// The means over the images.
    pub(crate) errors: Errors,
    /// The sum over the images.
    pub(crate) dropped_samples: u64,
}

/// The restarts of one technique with one number of samples, in the order in which they were made.
#[derive(Clone, Debug)]
pub(crate) struct Cell {
    pub(crate) samples: u32,
    pub(crate) runs: Vec<Run>,
}

/// All cells of a technique, with what its samples cost.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    pub(crate) technique: Candidate,
    pub(crate) cells: Vec<Cell>,
    pub(crate) passes: BTreeMap<&'static str, PassTime>,
    /// What a sample asks, kernel by kernel.
    pub(crate) asked: BTreeMap<&'static str, PerSample>,
    /// Samples that the passes have traced, over all pixels.
    pub(crate) traced: u64,
}

/// The measurements of a scene.
#[derive(Clone)]
pub(crate) struct SceneResult {
    pub(crate) scene: String,
    /// The file of its plot.
    pub(crate) plot: String,
    pub(crate) truth: Truth,
    pub(crate) reference_samples: u64,
    pub(crate) series: Vec<Series>,
    /// Restarts that were made.
    pub(crate) restarts: u32,
}

impl Cell {
    fn each(&self, of: impl Fn(&Run) -> f64) -> Vec<f64> {
        self.runs.iter().map(of).collect()
    }

    fn mean(&self, of: impl Fn(&Run) -> f64) -> f64 {
        fit::mean_and_error(&self.each(of)).0
    }

    pub(crate) fn seconds(&self) -> f64 {
        fit::median(&self.each(|run| run.seconds))
    }

    pub(crate) fn mse(&self, truth: &Truth) -> Figure {
        truth.mse(self.mean(|run| run.errors.mse))
    }

    pub(crate) fn rel_mse(&self, truth: &Truth) -> Figure {
        truth.rel_mse(self.mean(|run| run.errors.rel_mse))
    }

    /// MAPE as it is measured, refused where the reference has more than a small share in the MSE.
    pub(crate) fn mape(&self, truth: &Truth) -> Option<f64> {
        self.mse(truth).is_pure().then(|| self.mean(|run| run.errors.mape))
    }

    /// The bias of the mean, relative to it; the reference's error has its part in the interval.
    pub(crate) fn bias(&self, truth: &Truth) -> fit::Estimate {
        let means = self.each(|run| run.errors.mean);
        let (mean, error) = fit::mean_and_error(&means);
        let half_width = (fit::student(means.len().saturating_sub(1)) * error).hypot(fit::NORMAL * truth.mean_error);
        fit::Estimate { value: (mean - truth.mean) / truth.mean, half_width: half_width / truth.mean }
    }
}

impl Series {
    /// What a sample asks in all.
    pub(crate) fn per_sample(&self) -> PerSample {
        self.asked.values().fold(PerSample::default(), |sum, &kernel| sum.plus(kernel))
    }

    /// Millions of rays a second in the passes of a kernel, if it traces rays.
    pub(crate) fn mega_rays(&self, kernel: &str) -> Option<f64> {
        let (pass, asked) = self.passes.get(kernel).zip(self.asked.get(kernel))?;
        (asked.rays() > 0.0).then(|| asked.rays() * self.traced as f64 / pass.seconds * 1e-6)
    }

    /// Exponent of the RMSE in the number of samples, over the cells in which the reference has a small share.
    pub(crate) fn convergence(&self, truth: &Truth) -> Option<fit::Estimate> {
        let judged = || self.cells.iter().filter(|cell| cell.mse(truth).is_pure());
        let samples: Vec<f64> = judged().map(|cell| f64::from(cell.samples)).collect();
        let squared: Vec<_> = judged().map(|cell| cell.each(|run| run.errors.mse - truth.noise)).collect();
        fit::convergence(&samples, &squared)
    }

    /// (seconds, relMSE) of the cells that the reference can judge.
    pub(crate) fn error_over_time(&self, truth: &Truth) -> Vec<(f64, f64)> {
        let point = |cell: &Cell| cell.rel_mse(truth).corrected().map(|error| (cell.seconds(), error));
        self.cells.iter().filter_map(point).collect()
    }
}

/// Measures one scene against `truth`. Restarts are interleaved: each runs every technique with every number of
/// samples, so that a slow spell of the machine meets all of them; one image of each technique comes first and does not
/// count. `observe` hears of samples a pixel, of all that were asked for.
///
/// # Errors
/// As of [`Render::render`], and that of `observe`.
pub(crate) fn measure(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    matrix: &Matrix,
    truth: &Truth,
    observe: &mut dyn FnMut(Progress) -> Result<(), Error>,
) -> Result<(Vec<Series>, u32), Error> {
    let empty = |technique: &Candidate| {
        let asked = per_sample(scene, &technique.render)?;
        let cells = matrix.budgets.iter().map(|&samples| Cell { samples, runs: Vec::new() }).collect();
        Ok(Series { technique: technique.clone(), cells, passes: BTreeMap::new(), asked, traced: 0 })
    };
    let mut series = matrix.techniques.iter().map(empty).collect::<Result<Vec<_>, Error>>()?;
    let total = series.len() as u64 * u64::from(matrix.restarts) * matrix.samples_of_a_restart();
    for technique in &matrix.techniques {
        let once = Render { count: 1, ..technique.render.clone() };
        once.render_observed(scene, executor, &mut |_| observe(Progress { done: 0, total }))?;
    }
    let start = Instant::now();
    let (mut done, mut seed, mut restart) = (0, 0, 0);
    while restart < matrix.restarts && (restart < FEWEST_RESTARTS || start.elapsed() < matrix.time) {
        for (budget, &samples) in matrix.budgets.iter().enumerate() {
            let images = matrix.images(samples);
            for series in &mut series {
                let run = series.run(executor, scene, truth, [samples, images, seed], &mut |made| {
                    observe(Progress { done: done + u64::from(made) * u64::from(samples), total })
                })?;
                series.cells[budget].runs.push(run);
                done += u64::from(images) * u64::from(samples);
            }
            seed += images;
        }
        restart += 1;
    }
    Ok((series, restart))
}

impl Matrix {
    /// Images of so many samples in a restart.
    fn images(&self, samples: u32) -> u32 {
        self.budgets.last().map_or(1, |largest| largest / samples)
    }

    /// Samples a pixel that a technique takes in a restart.
    fn samples_of_a_restart(&self) -> u64 {
        self.budgets.iter().map(|&samples| u64::from(samples) * u64::from(self.images(samples))).sum()
    }

    /// Seeds that all restarts take.
    pub(crate) fn seeds(&self) -> u64 {
        let images: u64 = self.budgets.iter().map(|&samples| u64::from(self.images(samples))).sum();
        u64::from(self.restarts) * images
    }
}

impl Series {
    /// Makes the images of a restart; `observe` hears how many are done.
    fn run(
        &mut self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        truth: &Truth,
        [samples, images, seed]: [u32; 3],
        observe: &mut dyn FnMut(u32) -> Result<(), Error>,
    ) -> Result<Run, Error> {
        let (mut seconds, mut errors, mut dropped_samples) = (Vec::new(), Vec::new(), 0);
        for image in 0..images {
            let mut timed = Timed { inner: executor, passes: &mut self.passes };
            let begin = Instant::now();
            let of_image = Render { count: samples, seed: seed + image, ..self.technique.render.clone() };
            let rendered = of_image.render_observed(scene, &mut timed, &mut |_| observe(image))?;
            seconds.push(begin.elapsed().as_secs_f64());
            errors.push(truth.errors(&rendered.image));
            dropped_samples += rendered.dropped_samples;
            self.traced += u64::from(samples) * rendered.image.pixels.len() as u64;
        }
        let seconds = fit::median(&seconds);
        Ok(Run { seed, images, seconds, errors: Errors::mean(errors), dropped_samples })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir::advanced::reference::{self, Goal};
    use restir::technique::{Integral, PixelFilter};
    use restir::{exec::CpuExecutor, scene::Scene, technique::path::PathSettings};
    use restir_shared::rng::Sampler;
    use std::sync::OnceLock;
    use table::Setup;

    const PICTURE: Picture = Picture {
        size: [16; 2],
        integral: Integral { max_depth: 4, jitter: false, filter: PixelFilter::Box, multiscatter: true },
    };

    /// A small benchmark of the furnace; it is run once.
    pub(super) fn furnace() -> SceneResult {
        static RESULT: OnceLock<SceneResult> = OnceLock::new();
        RESULT.get_or_init(run_furnace).clone()
    }

    fn run_furnace() -> SceneResult {
        let scene = SceneBuffers::build(&Scene::load("furnace").unwrap()).unwrap();
        let technique = |name: &str, roulette| {
            // the error of independent numbers has a slope that is known
            let path =
                PathSettings { max_depth: 4, roulette, sampler: Sampler::Independent, ..PathSettings::default() };
            Candidate { name: name.to_owned(), render: Render::new(PICTURE.size, path) }
        };
        let matrix = Matrix {
            picture: PICTURE,
            techniques: vec![technique("path", false), technique("path:roulette=on", true)],
            budgets: vec![1, 2, 4, 8, 16],
            restarts: 6,
            time: Duration::from_secs(60),
        };
        let mut cpu = CpuExecutor::with_threads(1).unwrap();
        let goal = Goal { samples: 2048, time: None };
        let reference = reference::make(&mut cpu, &scene, PICTURE, None, goal, &mut |_| Ok(())).unwrap();
        let truth = Truth::new(&reference);
        let (series, restarts) = measure(&mut cpu, &scene, &matrix, &truth, &mut |_| Ok(())).unwrap();
        let [scene, plot] = ["furnace", "furnace.svg"].map(str::to_owned);
        SceneResult { scene, plot, truth, reference_samples: reference.samples(), series, restarts }
    }

    /// Of a benchmark of small pictures.
    pub(super) fn setup() -> Setup {
        let [command, machine, device, commit] = ["cargo lab bench", "a machine", "cpu", "c0ffee"].map(str::to_owned);
        Setup { command, machine, device, commit, picture: PICTURE }
    }

    #[test]
    fn the_furnace_converges_without_bias() {
        let result = furnace();
        assert_eq!((result.restarts, result.reference_samples), (6, 2048));
        for series in &result.series {
            let name = &series.technique.name;
            let fit = series.convergence(&result.truth).unwrap();
            // 144 equal pixels: each error is known to a tenth, the slope over 4 octaves to some 0.02
            assert!((fit.value + 0.5).abs() < 0.1, "{name}: {fit:?}");
            for cell in &series.cells {
                let bias = cell.bias(&result.truth);
                assert!(bias.value.abs() < 2.5 * bias.half_width, "{name}: {bias:?}");
                assert_eq!(cell.runs.len(), 6);
                assert!(cell.runs.iter().all(|run| run.images * cell.samples == 16));
                assert!(cell.runs.iter().all(|run| run.seconds > 0.0 && run.dropped_samples == 0));
            }
            assert!(series.mega_rays("path").unwrap() > 0.0);
            assert_eq!(series.mega_rays("film_resolve"), None);
            // closed: as many segments as it may have, less where roulette ends a path
            let segments = series.per_sample().closest;
            assert!(if name == "path" { segments == 4.0 } else { segments < 4.0 }, "{name}: {segments}");
        }
    }

    #[test]
    fn no_two_images_share_a_seed() {
        let runs = || furnace().series.remove(0).cells.into_iter().flat_map(|cell| cell.runs);
        let mut seeds: Vec<u32> = runs().flat_map(|run| run.seed..run.seed + run.images).collect();
        seeds.sort_unstable();
        assert_eq!(seeds, (0..6 * (16 + 8 + 4 + 2 + 1)).collect::<Vec<_>>());
    }
}
