//! Pictures of a scene against those of a plainer one with the same expectation, path by path with the same random numbers.

use super::scenes::{Variant, scene};
use crate::stats::{Moments, TileGrid, sidak, two_sided_threshold};
use glam::DVec3;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::Render;
use std::fmt;

/// The largest bias, as a share of a tile's mean.
pub const BIAS: f64 = 0.005;
/// How often the bound on a comparison's bias is too low.
pub(super) const FAMILY_RATE: f64 = 1.0e-3;
pub(super) const GRID: TileGrid = TileGrid { width: 16, height: 16, tile: 8 };
pub(super) const SIZE: [u32; 2] = [GRID.width, GRID.height];

/// A picture against a plainer one.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// What is compared.
    pub name: String,
    /// Samples or frames a pixel.
    pub count: u32,
    /// The largest difference of a tile's mean in a channel, relative to it.
    pub difference: f64,
    /// The same with what it may be wrong by.
    pub bound: f64,
    /// Samples that were dropped or are no finite numbers.
    pub broken: u64,
}

impl Comparison {
    /// Renders both with as many seeds as there are restarts, each in its own unit of light.
    pub(super) fn new(name: String, render: &Render, restarts: u32, variants: [Variant; 2]) -> Self {
        Self::of_two(name, [render, render], restarts, variants)
    }

    /// The same where each has settings of its own.
    pub(super) fn of_two(name: String, renders: [&Render; 2], restarts: u32, variants: [Variant; 2]) -> Self {
        let pictures = |render: &Render, variant: Variant| {
            let (mut pictures, broken) = pictures(&built(variant), render, restarts);
            let unit = 2.0_f64.powi(-variant.exposure);
            pictures.iter_mut().flatten().flatten().for_each(|x| *x *= unit);
            (pictures, broken)
        };
        let [(tested, broken), (reference, broken_too)] = [0, 1].map(|i| pictures(renders[i], variants[i]));
        let change = |(a, b): (&[f64; 3], &[f64; 3])| (DVec3::from(*a) - DVec3::from(*b)).to_array();
        let changes = tested.iter().zip(&reference).map(|(a, b)| a.iter().zip(b).map(change).collect());
        let changes: Vec<Picture> = changes.collect();
        let (difference, bound) = largest_difference(&GRID.moments_of(&reference), &GRID.moments_of(&changes));
        Self { name, count: restarts * renders[0].count, difference, bound, broken: broken + broken_too }
    }

    /// Whether the bias is known to be below [`BIAS`] and no sample is lost.
    pub fn passed(&self) -> bool {
        self.broken == 0 && self.bound <= BIAS
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, count, difference, bound, broken } = self;
        write!(f, "| {name} | {count} | {difference:.1e} | {bound:.1e} | {BIAS:.0e} | {broken} |")
    }
}

/// The largest difference among tiles, relative to their means, and an upper bound on it.
fn largest_difference(means: &[Moments], differences: &[Moments]) -> (f64, f64) {
    let reach = two_sided_threshold(sidak(FAMILY_RATE, means.len()));
    let largest = |reach: f64| {
        let relative = means.iter().zip(differences).map(|(mean, difference)| {
            let bias = (difference.mean().abs() + reach * difference.standard_error()) / mean.mean();
            if bias.is_finite() { bias } else { f64::INFINITY }
        });
        relative.fold(0.0, f64::max)
    };
    (largest(0.0), largest(reach))
}

/// Radiance of each pixel, rows from top to bottom.
pub(super) type Picture = Vec<[f64; 3]>;

/// Renders with successive seeds, and how many of their pixels were dropped or are no finite numbers.
pub(super) fn pictures(buffers: &SceneBuffers, render: &Render, restarts: u32) -> (Vec<Picture>, u64) {
    let picture = |restart| {
        let render = Render { seed: render.seed + restart, ..render.clone() };
        let rendered = render.render(buffers, &mut CpuExecutor::inline());
        let rendered = rendered.expect("the settings are sound");
        let pixels: Picture = rendered.image.pixels.iter().map(|pixel| pixel.map(f64::from)).collect();
        let broken = pixels.iter().filter(|pixel| !DVec3::from(**pixel).is_finite()).count() as u64;
        (pixels, rendered.dropped_samples + broken)
    };
    let (pictures, broken): (Vec<_>, Vec<u64>) = (0..restarts).into_par_iter().map(picture).unzip();
    (pictures, broken.iter().sum())
}

pub(super) fn built(variant: Variant) -> SceneBuffers {
    SceneBuffers::build(&scene(variant)).expect("the scene is valid")
}
