//! Renders that end when they are good enough, or after some time.
//!
//! The samples of a pixel are spread over it together, and frames reuse each other's: within one render they say nothing of its
//! error. So the image is the mean of renders with other seeds, *scrambles*, which are independent of each other, and their differences tell
//! the standard error of that mean.
//!
//! ```
//! use restir::render::Render;
//! use restir_cli::scrambles::{FEWEST, Until, render_until};
//! use restir::technique::path::PathSettings;
//! use restir::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 4, ..Render::new([16, 16], PathSettings { max_depth: 3, ..PathSettings::default() }) };
//! // until the standard error is a tenth of the mean radiance
//! let until = Until { time: None, noise: Some(0.1) };
//! let mean = render_until(&mut CpuExecutor::new()?, &scene, &job, until, &mut |_| Ok(()), &mut |_| Ok(()))?;
//! assert!(mean.noise() <= 0.1 && mean.count() >= FEWEST);
//! assert_eq!(mean.rendered().image.pixels.len(), 256);
//! # Ok::<(), Error>(())
//! ```

use std::time::{Duration, Instant};

use restir::exec::{Executor, Observer, Progress, Step};
use restir::image::Image;
use restir::render::{Render, Rendered};
use restir::{Error, buffers::SceneBuffers};

/// However little time there is, there are so many scrambles: fewer say too little of the error.
pub const FEWEST: u32 = 8;
/// Most samples that [`affordable`] gives a scramble.
const MOST_SAMPLES: f64 = 1024.0;
/// Parts of the whole in which progress is told.
const PARTS: f64 = 1000.0;

/// When to end; at the first of both.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Until {
    /// The scramble in work is given up after this time, but for the first [`FEWEST`].
    pub time: Option<Duration>,
    /// As of [`Mean::noise`].
    pub noise: Option<f64>,
}

/// The mean of the images of scrambles, and how far they differ.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mean {
    size: [u32; 2],
    count: u32,
    mean: Vec<f64>,
    /// Sums of squared differences from the mean.
    squares: Vec<f64>,
    dispatches: u64,
    dropped_samples: u64,
    counts: Vec<(&'static str, u64)>,
}

impl Mean {
    /// Adds an image (Welford 1962).
    pub fn add(&mut self, rendered: &Rendered) {
        let values = rendered.image.pixels.as_flattened();
        self.size = [rendered.image.width, rendered.image.height];
        self.mean.resize(values.len(), 0.0);
        self.squares.resize(values.len(), 0.0);
        self.count += 1;
        for ((mean, squares), &value) in self.mean.iter_mut().zip(&mut self.squares).zip(values) {
            let before = f64::from(value) - *mean;
            *mean += before / f64::from(self.count);
            *squares += before * (f64::from(value) - *mean);
        }
        self.dispatches += rendered.dispatches;
        self.dropped_samples += rendered.dropped_samples;
        for &(name, count) in &rendered.counts {
            match self.counts.iter_mut().find(|(of, _)| *of == name) {
                Some((_, sum)) => *sum += count,
                None => self.counts.push((name, count)),
            }
        }
    }

    /// How many images there are.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The standard error of the mean's values, root mean square over the image, relative to the image's mean; 0 of a black image, and
    /// infinite of less than two images.
    pub fn noise(&self) -> f64 {
        let count = f64::from(self.count);
        let variance = self.squares.iter().sum::<f64>() / (count * (count - 1.0));
        let (values, sum) = (self.mean.len() as f64, self.mean.iter().sum::<f64>());
        match self.count {
            0 | 1 => f64::INFINITY,
            _ if variance == 0.0 => 0.0,
            _ => (variance / values).sqrt() / (sum / values).abs(),
        }
    }

    /// The mean, with the dispatches, the dropped samples and the counts of all.
    pub fn rendered(&self) -> Rendered {
        let pixels = self.mean.as_chunks::<3>().0.iter().map(|pixel| pixel.map(|value| value as f32)).collect();
        let [width, height] = self.size;
        let image = Image { width, height, pixels };
        let Self { dispatches, dropped_samples, ref counts, .. } = *self;
        Rendered { image, dispatches, dropped_samples, counts: counts.clone() }
    }
}

/// The mean of renders with the seeds from that of `render` on, until it is time to end; `shown` sees it after each of them.
///
/// # Errors
/// As of [`Render::render`], and that of `shown`.
pub fn render_until(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    until: Until,
    observe: &mut dyn FnMut(Progress) -> Result<(), Error>,
    shown: &mut dyn FnMut(&Mean) -> Result<(), Error>,
) -> Result<Mean, Error> {
    let start = Instant::now();
    let mut mean = Mean::default();
    loop {
        let scramble = Render { seed: render.seed.wrapping_add(mean.count), ..render.clone() };
        let mut late = false;
        let rendered = scramble.render_observed(scene, executor, &mut |step: &Step<'_>| {
            observe(progress(&mean, until, start, step.progress))?;
            late = is_late(&mean, until, start);
            if late { Err(Error::Interrupted) } else { Ok(()) }
        });
        match rendered {
            Err(_) if late => return Ok(mean),
            rendered => mean.add(&rendered?),
        }
        shown(&mean)?;
        let is_good = mean.count >= FEWEST && until.noise.is_some_and(|noise| mean.noise() <= noise);
        if is_good || is_late(&mean, until, start) {
            return Ok(mean);
        }
    }
}

fn is_late(mean: &Mean, until: Until, start: Instant) -> bool {
    mean.count >= FEWEST && until.time.is_some_and(|time| start.elapsed() >= time)
}

/// How far it is, as far as that can be known: the noise falls with the root of the number of scrambles.
fn progress(mean: &Mean, until: Until, start: Instant, within: Progress) -> Progress {
    let begun = f64::from(mean.count) + within.done as f64 / within.total.max(1) as f64;
    let of_time = until.time.map(|time| start.elapsed().as_secs_f64() / time.as_secs_f64().max(1.0e-9));
    let of_noise = until.noise.filter(|_| mean.count > 1).map(|noise| (noise / mean.noise()).powi(2));
    let share = of_time.into_iter().chain(of_noise).fold(0.0, f64::max).min(begun / f64::from(FEWEST));
    Progress { done: (PARTS * share.min(1.0)) as u64, total: PARTS as u64 }
}

/// How many samples a scramble should have, so that there are some sixteen of them in a time: the more, the better are they spread.
/// One sample is rendered twice to find out; the first time, kernels may have to be compiled.
///
/// # Errors
/// As of [`Render::render`].
pub fn affordable(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    time: Duration,
    observe: &mut Observer<'_>,
) -> Result<u32, Error> {
    let one = Render { count: 1, ..render.clone() };
    one.render_observed(scene, executor, observe)?;
    let start = Instant::now();
    one.render_observed(scene, executor, observe)?;
    let samples = time.as_secs_f64() / (2.0 * f64::from(FEWEST) * start.elapsed().as_secs_f64().max(1.0e-6));
    Ok(1 << samples.clamp(1.0, MOST_SAMPLES).log2() as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir::exec::CpuExecutor;
    use restir::scene::builtin;
    use restir::technique::path::PathSettings;

    fn rendered(values: [f32; 3]) -> Rendered {
        let image = Image { width: 1, height: 1, pixels: vec![values] };
        Rendered { image, dispatches: 2, dropped_samples: 1, counts: vec![("walks", 3)] }
    }

    /// Worked out by hand: the means are 2, 1 and 0, the variances 2, 0 and 0.
    #[test]
    fn means_and_standard_errors() {
        let mut mean = Mean::default();
        mean.add(&rendered([1.0, 1.0, 0.0]));
        assert_eq!(mean.noise(), f64::INFINITY);
        mean.add(&rendered([3.0, 1.0, 0.0]));
        assert_eq!(mean.rendered().image.pixels, [[2.0, 1.0, 0.0]]);
        assert_eq!((mean.rendered().dispatches, mean.rendered().dropped_samples), (4, 2));
        assert_eq!(mean.rendered().counts, [("walks", 6)]);
        let expected = (2.0_f64 / 2.0 / 3.0).sqrt();
        assert!((mean.noise() - expected).abs() < 1.0e-12, "{}", mean.noise());
    }

    /// What is said of the error is the error. Of 24 images of 8 scrambles each, the squared noise that they say is compared with their
    /// variance about the mean of all. Over 3072 values the latter is known to about 1 / sqrt(23 * 3072 / 10), with ten times less for that
    /// values differ in variance: 1.2 %. The former is more precise. A tenth is eight standard errors; samples of one render that are
    /// taken for independent miss by more than that (the test's last line).
    #[test]
    fn the_noise_is_the_standard_error() {
        let scene = SceneBuffers::build(&builtin::scene("cornell").expect("built in")).expect("builds");
        let render = Render { count: 16, ..Render::new([32, 32], PathSettings::default()) };
        let mut cpu = CpuExecutor::inline();
        let mut of = |seed: u32, scrambles: u32| {
            let mut mean = Mean::default();
            for scramble in 0..scrambles {
                let one = Render { seed: seed + scramble, ..render.clone() };
                mean.add(&one.render(&scene, &mut cpu).expect("renders"));
            }
            mean
        };
        let groups: Vec<Mean> = (0..24).map(|group| of(100 * group, FEWEST)).collect();
        let mut all = Mean::default();
        groups.iter().for_each(|group| all.add(&group.rendered()));
        // of the mean of all, so of one by the root of their number
        let actual = all.noise() * 24_f64.sqrt();
        let said = (groups.iter().map(|group| group.noise().powi(2)).sum::<f64>() / 24.0).sqrt();
        assert!((said / actual - 1.0).abs() < 0.1, "{said} {actual}");
        let single = Render { count: 1, ..render.clone() };
        let mut samples = Mean::default();
        for seed in 0..16 {
            let one = Render { seed, ..single.clone() };
            samples.add(&one.render(&scene, &mut cpu).expect("renders"));
        }
        // 128 independent samples, instead of 8 times 16 spread ones
        assert!(samples.noise() / 8_f64.sqrt() > 1.1 * actual, "{} {actual}", samples.noise() / 8_f64.sqrt());
    }

    #[test]
    fn it_ends_by_noise_by_time_and_never_before_eight() {
        let scene = SceneBuffers::build(&builtin::scene("cornell").expect("built in")).expect("builds");
        let render = Render { count: 2, seed: 5, ..Render::new([16, 12], PathSettings::default()) };
        let mut cpu = CpuExecutor::inline();
        let mut until =
            |until| render_until(&mut cpu, &scene, &render, until, &mut |_| Ok(()), &mut |_| Ok(())).expect("renders");
        assert_eq!(until(Until { time: Some(Duration::ZERO), noise: None }).count(), FEWEST);
        let rough = until(Until { time: None, noise: Some(10.0) });
        assert_eq!(rough.count(), FEWEST);
        let goal = rough.noise() / 2.0;
        let good = until(Until { time: None, noise: Some(goal) });
        assert!(good.noise() <= goal && good.count() > 2 * FEWEST, "{} {}", good.noise(), good.count());
        let mut by_hand = Mean::default();
        for seed in 5..5 + FEWEST {
            let one = Render { seed, ..render.clone() };
            by_hand.add(&one.render(&scene, &mut cpu).expect("renders"));
        }
        assert_eq!(by_hand, rough);
    }
}
