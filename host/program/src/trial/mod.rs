//! Which of several renders has the least error for its time, found without a reference.
//!
//! Each render is made several times, with a seed of its own each time. Images of different seeds are independent, whatever the pixels and
//! frames of one image share, and those of an unbiased render scatter about the truth: their variance is the squared error of one image.
//! The error of a biased render has a second part, how far its mean is off; that is measured against the mean of the unbiased ones.
//!
//! Independent images may be averaged, so a render is judged by its squared error times its run time. Where samples are spread over a
//! pixel together, more of them gain more than the average of more images does, so such a render is better in a longer time than this
//! judgement says. Trials take turns, so that a slow spell of the machine meets all of them. Where a whole image would take too
//! long, some [windows](Window) of it stand for it.
//!
//! ```
//! use restir::render::Render;
//! use restir::technique::path::PathSettings;
//! use restir_cli::trial::{Subject, Tried, Window, judge, try_once, wall_clock};
//! use restir::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//!
//! let scene = Scene::load("cornell")?;
//! let subject = Subject::new(&scene, SceneBuffers::build(&scene)?, Vec::new(), 1)?;
//! let windows = Window::spread([16, 16], [16, 16], 0, 1);
//! let direct = PathSettings { max_depth: 2, ..PathSettings::default() };
//! let trials = [1, 16].map(|count| {
//!     subject.trial(&Render { count, ..Render::new([16, 16], direct.clone()) }, &windows)
//! });
//!
//! // three images of each, with other seeds: sixteen samples have less error than one
//! let (mut tried, clock) = ([Tried::default(), Tried::default()], wall_clock());
//! for seed in 0..3 {
//!     try_once(&mut CpuExecutor::new()?, &clock, &trials, &mut tried, seed, &mut |_| Ok(()))?;
//! }
//! let judged = judge(&trials, &tried);
//! assert!(judged[1].mse.value < 0.5 * judged[0].mse.value);
//! # Ok::<(), Error>(())
//! ```

mod interval;
mod subject;
mod window;

pub use interval::{NORMAL, jackknife, squared_difference, student};
pub use subject::{Subject, Trial};
pub use window::Window;

use std::time::Instant;

use restir::Error;
use restir::exec::Executor;
use restir::render::{Progress, Render};

/// relMSE divides by the squared truth and by this part of its squared mean.
const DARK: f64 = 0.01;

/// The images of a trial so far.
#[derive(Clone, Debug, Default)]
pub struct Tried {
    /// All values of the pixels that count.
    images: Vec<Vec<f64>>,
    seconds: Vec<f64>,
}

impl Tried {
    /// How many images there are.
    pub fn images(&self) -> usize {
        self.images.len()
    }

    /// The images, each as all values of the pixels that count.
    pub fn values(&self) -> &[Vec<f64>] {
        &self.images
    }
}

/// An error and its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The error.
    pub value: f64,
    /// Its standard error over the seeds.
    pub error: f64,
}

/// What is known of a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Median run time of an image.
    pub seconds: f64,
    /// Mean squared error of an image, over all values (three a pixel).
    pub mse: Estimate,
    /// The same relative to the squared truth, and a hundredth of its squared mean.
    pub rel_mse: Estimate,
}

impl Judgement {
    /// relMSE after the same time in which another trial has the relMSE 1.
    pub fn over(&self, other: &Self) -> Estimate {
        let cost = |of: &Self| of.rel_mse.value * of.seconds;
        let relative = |of: &Self| of.rel_mse.error / of.rel_mse.value;
        let value = cost(self) / cost(other);
        let error = if self == other { 0.0 } else { value * relative(self).hypot(relative(other)) };
        Estimate { value, error }
    }
}

/// Seconds since some moment, by the clock on the wall, or of processor time on a machine that others use, too.
pub type Clock<'a> = dyn Fn() -> f64 + 'a;

/// The clock on the wall, which begins at zero.
pub fn wall_clock() -> impl Fn() -> f64 {
    let begin = Instant::now();
    move || begin.elapsed().as_secs_f64()
}

/// One image more of each trial, with that seed. `observe` hears of passes of the trial in work, and may end the work.
///
/// # Errors
/// As of [`Render::render`].
pub fn try_once(
    executor: &mut dyn Executor,
    clock: &Clock<'_>,
    trials: &[Trial<'_>],
    tried: &mut [Tried],
    seed: u32,
    observe: &mut dyn FnMut(Progress) -> Result<(), Error>,
) -> Result<(), Error> {
    for (trial, tried) in trials.iter().zip(tried) {
        let (mut image, mut seconds) = (Vec::new(), 0.0);
        for (window, piece) in &trial.pieces {
            let piece = Render { seed, ..piece.clone() };
            let (pixels, of_piece) = timed(executor, clock, trial, window, &piece, observe)?;
            image.extend(window.inner(&pixels).flatten().map(|&value| f64::from(value)));
            seconds += of_piece;
        }
        tried.images.push(image);
        tried.seconds.push(seconds);
    }
    Ok(())
}

/// The pixels of a piece, and its part in the time of the whole image: passes over the pixels of a window take as much longer as
/// the image is larger, others take what they take.
fn timed(
    executor: &mut dyn Executor,
    clock: &Clock<'_>,
    trial: &Trial<'_>,
    window: &Window,
    piece: &Render,
    observe: &mut dyn FnMut(Progress) -> Result<(), Error>,
) -> Result<(Vec<[f32; 3]>, f64), Error> {
    let area = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
    let windows = trial.pieces.len() as f64;
    let scale = area(window.whole) / (area(window.size) * windows);
    let (mut seconds, mut last) = (0.0, clock());
    let rendered = piece.render_observed(trial.scene, executor, &mut |step| {
        let by_pixel = step.pass.grid == window.size;
        let now = clock();
        seconds += (now - last) * if by_pixel { scale } else { 1.0 / windows };
        last = now;
        observe(step.progress)
    })?;
    Ok((rendered.image.pixels, seconds))
}

/// The errors of all trials, from at least two images each; at least one trial is unbiased.
pub fn judge(trials: &[Trial<'_>], tried: &[Tried]) -> Vec<Judgement> {
    let means: Vec<Vec<f64>> = tried.iter().map(mean_image).collect();
    let is_biased = |trial: &Trial<'_>| trial.pieces.iter().any(|(_, piece)| !piece.technique.biases().is_empty());
    let biased: Vec<bool> = trials.iter().map(is_biased).collect();
    let ones = vec![1.0; means[0].len()];
    let plain: Vec<Estimate> = tried.iter().zip(&means).map(|(tried, mean)| variance(tried, mean, &ones)).collect();
    let shares = shares(&plain, tried, &biased);
    let truth = weighted_sum(&means, &shares);
    let weights = relative_weights(&truth);
    let relative: Vec<Estimate> =
        tried.iter().zip(&means).map(|(tried, mean)| variance(tried, mean, &weights)).collect();
    let judgement = |i: usize| {
        let with_bias = |variances: &[Estimate], weights: &[f64]| {
            let bias =
                if biased[i] { squared_bias(i, &means, &truth, variances, &shares, tried, weights) } else { 0.0 };
            Estimate { value: variances[i].value + bias, ..variances[i] }
        };
        Judgement {
            seconds: median(&tried[i].seconds),
            mse: with_bias(&plain, &ones),
            rel_mse: with_bias(&relative, &weights),
        }
    };
    (0..trials.len()).map(judgement).collect()
}

fn mean_image(Tried { images, .. }: &Tried) -> Vec<f64> {
    weighted_sum(images, &vec![1.0 / images.len() as f64; images.len()])
}

fn weighted_sum(images: &[Vec<f64>], weights: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; images[0].len()];
    for (image, weight) in images.iter().zip(weights) {
        sum.iter_mut().zip(image).for_each(|(sum, value)| *sum += weight * value);
    }
    sum
}

/// One over the denominators of relMSE.
fn relative_weights(truth: &[f64]) -> Vec<f64> {
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    truth.iter().map(|value| 1.0 / (value * value + DARK * mean * mean).max(f64::MIN_POSITIVE)).collect()
}

/// The mean variance of an image's values, each by its weight. Squares against the mean of all images, the image itself among
/// them, are too small by (n - 1) / n.
fn variance(tried: &Tried, mean: &[f64], weights: &[f64]) -> Estimate {
    let count = tried.images.len() as f64;
    let square = |((value, mean), weight): ((&f64, &f64), &f64)| weight * (value - mean) * (value - mean);
    let of_image = |image: &Vec<f64>| image.iter().zip(mean).zip(weights).map(square).sum::<f64>() / mean.len() as f64;
    let squares: Vec<f64> = tried.images.iter().map(|image| of_image(image) * count / (count - 1.0)).collect();
    let (value, error) = mean_and_error(&squares);
    Estimate { value, error }
}

/// The part that each trial's mean has in the truth: by the inverse of its variance, none if it is biased.
fn shares(variances: &[Estimate], tried: &[Tried], biased: &[bool]) -> Vec<f64> {
    let precision = |i: usize| {
        let counts = if biased[i] { 0.0 } else { tried[i].images.len() as f64 };
        counts / variances[i].value.max(f64::MIN_POSITIVE)
    };
    let all: Vec<f64> = (0..tried.len()).map(precision).collect();
    let sum: f64 = all.iter().sum();
    all.iter().map(|precision| precision / sum).collect()
}

/// How far the mean of a biased trial is from the truth, without the noise of either.
fn squared_bias(
    of: usize,
    means: &[Vec<f64>],
    truth: &[f64],
    variances: &[Estimate],
    shares: &[f64],
    tried: &[Tried],
    weights: &[f64],
) -> f64 {
    let of_mean = |i: usize| variances[i].value / tried[i].images.len() as f64;
    let noise = of_mean(of) + shares.iter().enumerate().map(|(i, share)| share * share * of_mean(i)).sum::<f64>();
    let squares =
        means[of].iter().zip(truth).zip(weights).map(|((mean, truth), weight)| weight * (mean - truth).powi(2));
    (squares.sum::<f64>() / truth.len() as f64 - noise).max(0.0)
}

/// The mean and its standard error, which is NaN for fewer than two values.
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (count * (count - 1.0))).sqrt())
}

/// The median; NaN of nothing.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.get(middle) {
        None => f64::NAN,
        Some(&upper) if sorted.len() % 2 == 1 => upper,
        Some(&upper) => 0.5 * (sorted[middle - 1] + upper),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir::buffers::SceneBuffers;
    use restir::exec::CpuExecutor;
    use restir::scene::builtin;
    use restir::shared::rng::Sampler;
    use restir::technique::path::PathSettings;
    use restir::technique::restir_di::DiSettings;

    const WHOLE: [Window; 1] = [Window { whole: [24; 2], size: [24; 2], margin: 0, middle: [0.0; 2] }];

    fn subject(name: &str) -> Subject {
        let scene = builtin::scene(name).expect("built in");
        let buffers = SceneBuffers::build(&scene).expect("builds");
        Subject::new(&scene, buffers, Vec::new(), 8).expect("builds")
    }

    fn judged(trials: &[Trial<'_>], images: u32) -> Vec<Judgement> {
        let mut cpu = CpuExecutor::with_threads(1).expect("a thread");
        let mut tried = vec![Tried::default(); trials.len()];
        for seed in 0..images {
            try_once(&mut cpu, &wall_clock(), trials, &mut tried, seed, &mut |_| Ok(())).expect("renders");
        }
        judge(trials, &tried)
    }

    /// Four times the samples have a quarter of the squared error.
    #[test]
    fn the_variance_is_the_squared_error() {
        let subject = subject("cornell");
        let path = |count| {
            // the variance of whose mean is known to fall as 1 / n
            let path = PathSettings { max_depth: 2, sampler: Sampler::Independent, ..PathSettings::default() };
            subject.trial(&Render { count, ..Render::new([24, 24], path) }, &WHOLE)
        };
        let judged = judged(&[path(4), path(16)], 48);
        let ratio = judged[0].mse.value / judged[1].mse.value;
        let deviation =
            ratio * (judged[0].mse.error / judged[0].mse.value).hypot(judged[1].mse.error / judged[1].mse.value);
        assert!((ratio - 4.0).abs() < 4.0 * deviation && deviation < 0.6, "{ratio} {deviation}");
        let itself = judged[0].over(&judged[0]);
        assert_eq!((itself.value, itself.error), (1.0, 0.0));
    }

    /// What a biased setting is off by counts as its error, and has no part in the truth.
    #[test]
    fn bias_is_an_error() {
        let subject = subject("many-lights");
        let of = |settings: DiSettings| subject.trial(&Render { count: 8, ..Render::new([24, 24], settings) }, &WHOLE);
        let biased = DiSettings::preset("biased-2020").expect("a preset");
        let trials = [of(DiSettings::default()), of(biased)];
        let mut cpu = CpuExecutor::with_threads(1).expect("a thread");
        let mut tried = vec![Tried::default(); 2];
        for seed in 0..12 {
            try_once(&mut cpu, &wall_clock(), &trials, &mut tried, seed, &mut |_| Ok(())).expect("renders");
        }
        let judged = judge(&trials, &tried);
        let mean = mean_image(&tried[1]);
        let scatter = variance(&tried[1], &mean, &vec![1.0; mean.len()]);
        assert!(judged[1].mse.value >= scatter.value, "{judged:?} {scatter:?}");
        let plain = variance(&tried[0], &mean_image(&tried[0]), &vec![1.0; mean.len()]);
        assert_eq!(judged[0].mse, plain);
    }
}
