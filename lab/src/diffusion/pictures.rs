//! Renders of one scene by several methods, independent of each other: how they differ, with error bars.

use std::fmt;

use rayon::prelude::*;
use restir_cli::trial::{self, Estimate, squared_difference, student};
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::Render;
use restir_host::technique::path::PathSettings;

use crate::Error;
use crate::time::thread_seconds;

/// Renders of each method, by other random numbers.
pub(super) const RUNS: usize = 8;
/// Pixels along a side of the tiles that are compared.
pub(super) const TILE: usize = 8;
/// Widths and heights of the pictures.
pub(super) const SIZE: [u32; 2] = [48, 64];

/// Red, green and blue of all pixels of a render, and the time of this thread in seconds.
pub(super) fn image(
    scene: &SceneBuffers,
    settings: &PathSettings,
    size: [u32; 2],
    samples: u32,
    seed: u32,
) -> Result<(Vec<f64>, f64), Error> {
    let render = Render { count: samples, seed, ..Render::new(size, settings.clone()) };
    let start = thread_seconds();
    let rendered = render.render(scene, &mut CpuExecutor::inline())?;
    let time = thread_seconds() - start;
    Ok((rendered.image.pixels.iter().flatten().map(|&value| f64::from(value)).collect(), time))
}

/// [`RUNS`] pictures by one method.
pub(super) struct Pictures {
    pub(super) runs: Vec<Vec<f64>>,
    /// Milliseconds of a sample of the picture, in each.
    pub(super) milliseconds: Vec<f64>,
}

impl Pictures {
    /// Of so many samples a pixel in each. Pictures of the same `seed` have the same random numbers.
    pub(super) fn of(
        scene: &SceneBuffers,
        settings: &PathSettings,
        size: [u32; 2],
        samples: u32,
        seed: u32,
    ) -> Result<Self, Error> {
        let one = |run| image(scene, settings, size, samples, seed * RUNS as u32 + run);
        let found = (0..RUNS as u32).into_par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
        let (runs, seconds): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        Ok(Self { runs, milliseconds: seconds.iter().map(|time| 1000.0 * time / f64::from(samples)).collect() })
    }

    /// The sums over tiles of pictures of [`SIZE`].
    pub(super) fn tiles(&self) -> Self {
        let runs = self.runs.iter().map(|picture| tiles(picture)).collect();
        Self { runs, milliseconds: self.milliseconds.clone() }
    }

    /// The mean over all values.
    pub(super) fn mean(&self, runs: &[usize]) -> f64 {
        let of_run = |&run: &usize| self.runs[run].iter().sum::<f64>() / self.runs[run].len() as f64;
        runs.iter().map(of_run).sum::<f64>() / runs.len() as f64
    }

    /// The root of the mean squared difference from other pictures, over their mean; without the noise of both, so that it may come out negative.
    pub(super) fn off(&self, from: &Self) -> Interval {
        Interval::of(|runs| root(squared_difference(&self.runs, &from.runs, runs)) / from.mean(runs))
    }
}

fn tiles(picture: &[f64]) -> Vec<f64> {
    let (width, across) = (SIZE[0] as usize, SIZE[0] as usize / TILE);
    let mut tiles = vec![0.0; 3 * across * (SIZE[1] as usize / TILE)];
    for (index, pixel) in picture.chunks_exact(3).enumerate() {
        let tile = index / width / TILE * across + index % width / TILE;
        (0..3).for_each(|c| tiles[3 * tile + c] += pixel[c]);
    }
    tiles
}

/// The root with the sign of what is below it.
pub(super) fn root(squared: f64) -> f64 {
    squared.signum() * squared.abs().sqrt()
}

/// A number with the half width of its interval of 95 %.
#[derive(Clone, Copy)]
pub(super) struct Interval {
    pub(super) value: f64,
    pub(super) half_width: f64,
}

impl Interval {
    /// A statistic of all runs, which is told which of them it is of.
    pub(super) fn of(statistic: impl Fn(&[usize]) -> f64) -> Self {
        let Estimate { value, error } = trial::jackknife(RUNS, statistic);
        Self { value, half_width: student(RUNS - 1) * error }
    }

    /// Whether it is above zero, if the interval knows.
    pub(super) fn is_positive(self) -> Option<bool> {
        (self.value.abs() > self.half_width).then_some(self.value > 0.0)
    }

    pub(super) fn percent(self) -> String {
        format!("{:.1} %", Self { value: 100.0 * self.value, half_width: 100.0 * self.half_width })
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = f.precision().unwrap_or(3);
        write!(f, "{:.digits$} ± {:.digits$}", self.value, self.half_width)
    }
}
