//! How noisy a pixel is.

use super::accumulate::History;
use super::guide::Guide;
use super::params::DenoiseParams;
use crate::num;
use crate::vec::luminance;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// A pixel of light over reflectance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Estimate {
    /// Linear RGB.
    pub color: [f32; 3],
    /// Variance of its luminance; [`Self::KEPT`] of a pixel that stays as it is, and that nobody takes from.
    pub variance: f32,
}

const _: () = assert!(size_of::<Estimate>() == 16);

impl Estimate {
    /// See [`Self::variance`].
    pub const KEPT: f32 = -1.0;

    /// Whether the pixel takes part.
    #[inline(always)]
    pub fn is_filtered(&self) -> bool {
        self.variance >= 0.0
    }
}

/// The luminance of light; what is too dark for its square to be a number of its own is black, on every device.
#[inline(always)]
pub(super) fn brightness(color: [f32; 3]) -> f32 {
    let bright = luminance(Vec3::from_array(color));
    if bright < DARK { 0.0 } else { bright }
}

/// A variance, or a part of one, that is not too small to be told from none on every device.
#[inline(always)]
pub(super) fn told(variance: f32) -> f32 {
    if variance < DARK * DARK { 0.0 } else { variance }
}

/// See [`brightness`].
const DARK: f32 = 1.0e-15;
/// Surfaces that differ by less are one, as of [`Guide::difference`].
const ALIKE: f32 = 3.0;
/// Neighbours that count less do not count.
pub(super) const LEAST: f32 = 1.0e-6;

/// From so many frames on the variance is that of a pixel's own frames.
const ENOUGH: f32 = 4.0;
/// A pixel that is brighter than its neighbours' mean by so many of their standard deviations is an error of its own.
const OUTLIER: f32 = 32.0;
/// With fewer neighbours nobody can tell.
const OTHERS: f32 = 8.0;
/// Neighbours are looked at so far, where a pixel has too few frames; else next to it.
const RADIUS: i32 = 3;
/// Pixels in a row of these.
const SIDE: i32 = 2 * RADIUS + 1;

/// The mean of a pixel's frames and its variance: with few frames that of pixels around it.
#[inline(always)]
pub fn estimate(params: &DenoiseParams, guides: &[Guide], means: &[History], at: [u32; 2]) -> Estimate {
    let (index, _) = params.neighbour(at, 0, 0);
    let (guide, own) = (guides[index], means[index]);
    if own.frames == 0.0 {
        return Estimate { color: own.color, variance: Estimate::KEPT };
    }
    let young = own.observed < ENOUGH;
    let radius = if young { RADIUS } else { 1 };
    let around = Around::of(params, &guide, guides, means, at, radius);
    let bright = brightness(own.color);
    let among = around.spatial();
    let variance = if young { along(params, &guide, guides, means, at) } else { around.temporal(&own) };
    let deviation = num::sqrt(among.variance);
    // where neighbours are as noisy as bright, it is a sample as theirs are
    let alone =
        young & (among.weight > OTHERS) & (deviation < among.mean) & (bright > among.mean + OUTLIER * deviation);
    Estimate { color: own.color, variance: if alone { Estimate::KEPT } else { told(variance) } }
}

/// Mean and variance of a pixel's neighbours.
struct Neighbours {
    weight: f32,
    mean: f32,
    variance: f32,
}

/// Half the mean square of differences between pixels that are next to each other, in that of four directions in which it is least. Noise
/// is the same in all of them; light that has an edge has none along it.
#[inline(always)]
fn along(params: &DenoiseParams, guide: &Guide, guides: &[Guide], means: &[History], at: [u32; 2]) -> f32 {
    let mut least = f32::MAX;
    let mut direction = 0;
    while direction < 4 {
        // to the right, down, and down to the right and to the left
        let across = if direction == 3 { -1 } else { i32::from(direction != 1) };
        let down = i32::from(direction != 0);
        let (mut squares, mut pairs) = (0.0, 0.0);
        let mut tap = 0;
        while tap < SIDE * SIDE {
            let (dx, dy) = (tap % SIDE - RADIUS, tap / SIDE - RADIUS);
            let (index, inside) = params.neighbour(at, dx, dy);
            let (next, also) = params.neighbour(at, dx + across, dy + down);
            let (mean, other) = (means[index], means[next]);
            let offset = Vec2::new(dx as f32, dy as f32);
            let beyond = Vec2::new((dx + across) as f32, (dy + down) as f32);
            let same = (guide.difference(&guides[index], offset, params.spread) < ALIKE)
                & (guide.difference(&guides[next], beyond, params.spread) < ALIKE);
            if inside & also & same & (mean.frames > 0.0) & (other.frames > 0.0) {
                let off = brightness(mean.color) - brightness(other.color);
                pairs += 1.0;
                squares += told(off * off);
            }
            tap += 1;
        }
        least = if pairs > 0.0 { num::min(least, num::div(0.5 * squares, pairs)) } else { least };
        direction += 1;
    }
    if least < f32::MAX { least } else { 0.0 }
}

/// Sums over the neighbours of a pixel, weighted by how alike they are.
struct Around {
    weight: f32,
    first: f32,
    second: f32,
    noise: f32,
}

impl Around {
    #[inline(always)]
    fn of(
        params: &DenoiseParams,
        guide: &Guide,
        guides: &[Guide],
        means: &[History],
        at: [u32; 2],
        radius: i32,
    ) -> Self {
        let mut sum = Self { weight: 0.0, first: 0.0, second: 0.0, noise: 0.0 };
        let side = 2 * radius + 1;
        let mut tap = 0;
        while tap < side * side {
            let (dx, dy) = (tap % side - radius, tap / side - radius);
            let (index, inside) = params.neighbour(at, dx, dy);
            if inside & (tap * 2 + 1 != side * side) & (means[index].frames > 0.0) {
                let (other, mean) = (guides[index], means[index]);
                let offset = Vec2::new(dx as f32, dy as f32);
                let alike = num::exp(-guide.difference(&other, offset, params.spread));
                let weight = if alike < LEAST { 0.0 } else { alike };
                let bright = brightness(mean.color);
                sum.weight += weight;
                sum.first += weight * bright;
                sum.second += weight * (bright * bright);
                sum.noise += weight * mean.noise();
            }
            tap += 1;
        }
        sum
    }

    /// Of the neighbours' light.
    #[inline(always)]
    fn spatial(&self) -> Neighbours {
        let scale = if self.weight > 0.0 { num::recip(self.weight) } else { 0.0 };
        let mean = self.first * scale;
        Neighbours { weight: self.weight, mean, variance: told(self.second * scale - mean * mean) }
    }

    /// Of a pixel's frames, and its neighbours': the mean of the variances of all.
    #[inline(always)]
    fn temporal(&self, own: &History) -> f32 {
        num::div(self.noise + own.noise(), self.weight + 1.0)
    }
}

impl History {
    /// The variance of the mean by that of its frames; 0 of a single one.
    #[inline(always)]
    fn noise(&self) -> f32 {
        let spread = told(self.second - self.first * self.first);
        let others = num::max(self.observed - 1.0, 1.0);
        num::div(spread * self.observed, others * self.frames)
    }
}
