//! Independent chains of frames: each begins without a history, and its last frame or the mean of all is its image.

use std::time::Instant;

use restir::render::{Progress, Render};
use restir::{Error, buffers::SceneBuffers, exec::Executor, technique::Technique};

use crate::bench::error::{Errors, Truth};
use crate::bench::fit::{self, Estimate};

/// What is made of every configuration.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Protocol {
    pub(crate) size: [u32; 2],
    /// Frames before the last one.
    pub(crate) warm_up: u32,
    /// Chains; their seeds are their numbers.
    pub(crate) chains: u32,
    /// The image is the mean of all frames instead of the last one.
    pub(crate) accumulate: bool,
}

/// The chains of one configuration.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chains {
    /// Seconds a frame, of each chain.
    pub(crate) seconds: Vec<f64>,
    /// The values of each chain's image.
    pub(crate) images: Vec<Vec<f64>>,
}

/// Runs the chains of all configurations, interleaved: a slow spell of the machine meets all of them. `observe` hears of
/// chains.
///
/// # Errors
/// As of [`Render::render`]; that of `observe`.
pub(crate) fn run(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    configurations: &[impl Technique],
    protocol: Protocol,
    observe: &mut dyn FnMut(Progress) -> Result<(), Error>,
) -> Result<Vec<Chains>, Error> {
    let mut all = vec![Chains::default(); configurations.len()];
    let total = configurations.len() as u64 * u64::from(protocol.chains);
    let mut done = 0;
    for seed in 0..protocol.chains {
        for (chains, technique) in all.iter_mut().zip(configurations) {
            let count = protocol.warm_up + 1;
            let accumulate = protocol.accumulate;
            let render = Render { count, seed, accumulate, ..Render::new(protocol.size, technique.boxed()) };
            let start = Instant::now();
            let rendered = render.render_observed(scene, executor, &mut |_| observe(Progress { done, total }))?;
            chains.seconds.push(start.elapsed().as_secs_f64() / f64::from(count));
            chains.images.push(rendered.image.pixels.as_flattened().iter().map(|&x| f64::from(x)).collect());
            done += 1;
        }
    }
    Ok(all)
}

impl Chains {
    /// Median over the chains.
    pub(crate) fn seconds_a_frame(&self) -> f64 {
        fit::median(&self.seconds)
    }

    /// The errors of means of `count` chains each, as many as there are.
    pub(crate) fn errors(&self, truth: &Truth, count: usize) -> Vec<Errors> {
        let of_mean = |images: &[Vec<f64>]| {
            let mean = |i: usize| images.iter().map(|image| image[i]).sum::<f64>() / images.len() as f64;
            truth.errors_of((0..images[0].len()).map(mean))
        };
        self.images.chunks_exact(count).map(of_mean).collect()
    }

    /// The mean of all chains over that of the reference, and how many standard errors it is from 1.
    pub(crate) fn energy(&self, truth: &Truth) -> (Estimate, f64) {
        let means: Vec<f64> = self.errors(truth, 1).iter().map(|errors| errors.mean).collect();
        let (mean, error) = fit::mean_and_error(&means);
        let error = error.hypot(truth.mean_error);
        let ratio = Estimate { value: mean / truth.mean, half_width: fit::NORMAL * error / truth.mean };
        (ratio, (mean - truth.mean) / error)
    }

    /// The exponent of the RMSE in the number of chains, over blocks of a fourth of the chains. The numbers share images,
    /// so that the interval is too wide.
    pub(crate) fn slope(&self, truth: &Truth) -> Option<Estimate> {
        let block = self.images.len() / 4;
        let counts: Vec<usize> = std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|&n| n <= block).collect();
        let squared: Vec<Vec<f64>> = counts
            .iter()
            .map(|&count| {
                let errors = self.errors(truth, count);
                let of_block = |errors: &[Errors]| Errors::mean(errors.iter().copied()).mse - truth.noise;
                errors.chunks_exact(block / count).map(of_block).collect()
            })
            .collect();
        let samples: Vec<f64> = counts.iter().map(|&count| count as f64).collect();
        fit::convergence(&samples, &squared)
    }
}
