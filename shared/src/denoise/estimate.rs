//! How noisy a pixel is.

use super::accumulate::History;
use super::guide::Guide;
use super::params::DenoiseParams;
use super::reflectance::Reflectance;
use crate::num;
use crate::vec::luminance;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};

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
/// Surfaces that give back less tell nothing of the light.
const BLACK: f32 = 1.0 / 128.0;
/// Neighbours that count less do not count.
pub(super) const LEAST: f32 = 1.0e-6;

/// From so many frames on the variance is that of a pixel's own frames.
const ENOUGH: f32 = 4.0;
/// A pixel that is brighter than its neighbours' mean by so many of their standard deviations is an error of its own.
const OUTLIER: f32 = 32.0;
/// With fewer neighbours nobody can tell.
const OTHERS: f32 = 8.0;
/// Fewer pairs in a direction may be copies of the same sample.
const MANY: f32 = 12.0;
/// Neighbours are looked at so far, where a pixel has too few frames; else next to it.
const RADIUS: i32 = 3;

/// How a pixel differs from those next to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Contrast {
    /// Squared differences of luminance from the next pixel to the right, below, and below to the right and to the left; [`Self::APART`] where
    /// that sees another surface, or one of the two is black.
    squares: [f32; 4],
}

const _: () = assert!(size_of::<Contrast>() == size_of::<Estimate>());

impl Contrast {
    /// See there.
    const APART: f32 = -1.0;
}

/// How a pixel differs from the next ones in four directions.
#[inline(always)]
pub fn contrast(params: &DenoiseParams, guides: &[Guide], means: &[History], at: [u32; 2]) -> Contrast {
    let right = off_squared(params, guides, means, at, 1, 0);
    let below = off_squared(params, guides, means, at, 0, 1);
    let below_right = off_squared(params, guides, means, at, 1, 1);
    let below_left = off_squared(params, guides, means, at, -1, 1);
    Contrast { squares: [right, below, below_right, below_left] }
}

/// See [`Contrast`].
#[inline(always)]
fn off_squared(
    params: &DenoiseParams,
    guides: &[Guide],
    means: &[History],
    at: [u32; 2],
    across: i32,
    down: i32,
) -> f32 {
    let (index, _) = params.neighbour(at, 0, 0);
    let (next, inside) = params.neighbour(at, across, down);
    let (own, other) = (means[index], means[next]);
    let offset = Vec2::new(across as f32, down as f32);
    let same = guides[index].difference(&guides[next], offset, params.spread) < ALIKE;
    let black = num::min(told_of(own.reflectance), told_of(other.reflectance)) < BLACK;
    let off = brightness(own.color) - brightness(other.color);
    if inside & same & !black & (own.frames > 0.0) & (other.frames > 0.0) { told(off * off) } else { Contrast::APART }
}

/// The mean of a pixel's frames and its variance: with few frames that of pixels around it, whose contrasts are those of [`contrast()`].
#[inline(always)]
pub fn estimate(
    params: &DenoiseParams,
    guides: &[Guide],
    means: &[History],
    contrasts: &[Contrast],
    at: [u32; 2],
) -> Estimate {
    let (index, _) = params.neighbour(at, 0, 0);
    let own = means[index];
    if own.frames == 0.0 {
        return Estimate { color: own.color, variance: Estimate::KEPT };
    }
    let young = own.observed < ENOUGH;
    let around = Around::of(params, guides, means, contrasts, at, if young { RADIUS } else { 1 });
    let bright = brightness(own.color);
    let among = around.spatial(told_of(own.reflectance));
    let variance =
        if young { around.along(own.observed > 0.0) } else { around.temporal(&own, told_of(own.reflectance)) };
    let deviation = num::sqrt(among.variance);
    // where neighbours are as noisy as bright, it is a sample as theirs are
    let alone =
        young & (among.weight > OTHERS) & (deviation < among.mean) & (bright > among.mean + OUTLIER * deviation);
    Estimate { color: own.color, variance: if alone { Estimate::KEPT } else { told(variance) } }
}

/// How much a surface tells of the light.
#[inline(always)]
fn told_of(reflectance: Reflectance) -> f32 {
    luminance(reflectance.channels())
}

/// Mean and variance of a pixel's neighbours.
struct Neighbours {
    weight: f32,
    mean: f32,
    variance: f32,
}

/// Sums over the neighbours of a pixel.
struct Around {
    /// How alike they are.
    weight: f32,
    /// By that, of their luminance, its square, and the variance over frames.
    first: f32,
    second: f32,
    noise: f32,
    /// Of those on the same surface, contrasts in four directions and their number.
    squares: Vec4,
    pairs: Vec4,
}

impl Around {
    #[inline(always)]
    fn of(
        params: &DenoiseParams,
        guides: &[Guide],
        means: &[History],
        contrasts: &[Contrast],
        at: [u32; 2],
        radius: i32,
    ) -> Self {
        let (middle, _) = params.neighbour(at, 0, 0);
        let guide = guides[middle];
        let mut sum = Self { weight: 0.0, first: 0.0, second: 0.0, noise: 0.0, squares: Vec4::ZERO, pairs: Vec4::ZERO };
        let side = 2 * radius + 1;
        let mut tap = 0;
        while tap < side * side {
            let (dx, dy) = (tap % side - radius, tap / side - radius);
            let (index, inside) = params.neighbour(at, dx, dy);
            let mean = means[index];
            if inside & (mean.frames > 0.0) {
                let offset = Vec2::new(dx as f32, dy as f32);
                let difference = guide.difference(&guides[index], offset, params.spread);
                if difference < ALIKE {
                    sum.contrasts(&contrasts[index]);
                }
                if index != middle {
                    sum.neighbour(&mean, num::exp(-difference));
                }
            }
            tap += 1;
        }
        sum
    }

    #[inline(always)]
    fn neighbour(&mut self, mean: &History, alike: f32) {
        let weight = if alike < LEAST { 0.0 } else { alike * told_of(mean.reflectance) };
        let bright = brightness(mean.color);
        self.weight += weight;
        self.first += weight * bright;
        self.second += weight * (bright * bright);
        self.noise += weight * mean.noise();
    }

    #[inline(always)]
    fn contrasts(&mut self, contrast: &Contrast) {
        let [a, b, c, d] = contrast.squares;
        let counts = |square: f32| if square < 0.0 { 0.0 } else { 1.0 };
        self.squares += Vec4::new(num::max(a, 0.0), num::max(b, 0.0), num::max(c, 0.0), num::max(d, 0.0));
        self.pairs += Vec4::new(counts(a), counts(b), counts(c), counts(d));
    }

    /// Half the mean square of differences between pixels that are next to each other, in that of four directions in which it is least. Noise
    /// is the same in all of them; light that has an edge has none along it. Of few pairs in single frames it is the mean of all: two
    /// pixels with copies of one sample have no difference, but in one direction only.
    #[inline(always)]
    fn along(&self, single: bool) -> f32 {
        let Self { squares, pairs, .. } = *self;
        let of_all = squares.x + squares.y + (squares.z + squares.w);
        let count = pairs.x + pairs.y + (pairs.z + pairs.w);
        let all = if count > 0.0 { num::div(of_all, count) } else { 0.0 };
        let enough = if single { MANY } else { 1.0 };
        let mean = |sum: f32, pairs: f32| if pairs < enough { all } else { num::div(sum, pairs) };
        let straight = num::min(mean(squares.x, pairs.x), mean(squares.y, pairs.y));
        0.5 * num::min(straight, num::min(mean(squares.z, pairs.z), mean(squares.w, pairs.w)))
    }

    /// Of the neighbours' light.
    #[inline(always)]
    fn spatial(&self, reflectance: f32) -> Neighbours {
        let scale = if self.weight > 0.0 { num::recip(self.weight) } else { 0.0 };
        let mean = self.first * scale;
        Neighbours {
            weight: num::div(self.weight, reflectance),
            mean,
            variance: told(self.second * scale - mean * mean),
        }
    }

    /// Of a pixel's frames, and its neighbours': the mean of the variances of all.
    #[inline(always)]
    fn temporal(&self, own: &History, reflectance: f32) -> f32 {
        num::div(self.noise + own.noise() * reflectance, self.weight + reflectance)
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
