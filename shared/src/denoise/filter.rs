//! The edge-avoiding à-trous filter.

use super::accumulate::History;
use super::estimate::{Estimate, LEAST, brightness, told};
use super::guide::{Guide, Track};
use super::params::DenoiseParams;
use super::reflectance::Reflectance;
use crate::layout::FilmPixel;
use crate::num;
use crate::vec::{self, flush, luminance};
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// The cubic B-spline at whole numbers: 3/8, 1/4, 1/16.
const SPLINE: [f32; 3] = [0.375, 0.25, 0.0625];
/// The weight of the pixel itself in the kernel.
const MIDDLE: f32 = SPLINE[0] * SPLINE[0];
/// Differences of luminance below this do not matter.
const TINY: f32 = 1.0e-10;

/// What a pixel is worth in a round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Share {
    /// By channel, one over the root of the mean reflectance of the surface that the pixel sees, over a round's kernel; where that has an
    /// end, it is as if it were black beyond.
    scale: [f32; 3],
    /// Its own.
    reflectance: Reflectance,
}

const _: () = assert!(size_of::<Share>() == 16);

/// What the pixel is worth in a round.
#[inline(always)]
pub fn share(params: &DenoiseParams, guides: &[Guide], means: &[History], at: [u32; 2]) -> Share {
    let (index, _) = params.neighbour(at, 0, 0);
    let (guide, reflectance) = (guides[index], means[index].reflectance);
    let mut sum = reflectance.channels() * MIDDLE;
    let mut tap = 0;
    while tap < 25 {
        let (index, offset, weight) = neighbour(params, at, tap);
        if weight > 0.0 {
            let alike = weight * num::exp(-guide.difference(&guides[index], offset, params.spread));
            sum += means[index].reflectance.channels() * if alike < LEAST { 0.0 } else { alike };
        }
        tap += 1;
    }
    let scale = |sum: f32| if sum > 0.0 { num::rsqrt(sum) } else { 0.0 };
    Share { scale: [scale(sum.x), scale(sum.y), scale(sum.z)], reflectance }
}

/// One round: the mean of a pixel and its neighbours, [`DenoiseParams::step`] apart, and the variance that is left. `shares` are those of
/// [`share()`].
///
/// The usual form divides by the sum of all weights, and loses light: a bright pixel takes part in its own mean alone, and in those of none of its
/// neighbours. Here two pixels give each other the same, as far as their surfaces give it back, and what is left of the weights goes to the
/// pixel itself. So the sum of light that is given back stays, and black surfaces, which tell nothing of the light, count for nothing.
#[inline(always)]
pub fn filter(
    params: &DenoiseParams,
    guides: &[Guide],
    light: &[Estimate],
    shares: &[Share],
    at: [u32; 2],
) -> Estimate {
    let (index, _) = params.neighbour(at, 0, 0);
    let (guide, own, own_share) = (guides[index], light[index], shares[index]);
    if !own.is_filtered() {
        return own;
    }
    let bright = brightness(own.color);
    let own_scale = Vec3::from_array(own_share.scale);
    let mut rest = Vec3::ONE;
    let mut color = Vec3::ZERO;
    let mut variance = 0.0;
    let mut tap = 0;
    while tap < 25 {
        let (index, offset, weight) = neighbour(params, at, tap);
        let other = light[index];
        if (weight > 0.0) & other.is_filtered() {
            let noise = params.deviations * num::sqrt(own.variance + other.variance) + TINY;
            let off = num::div(num::abs(bright - brightness(other.color)), noise);
            let surface = guide.difference(&guides[index], offset, params.spread);
            let alike = weight * num::exp(-(surface + off));
            let both = own_scale * shares[index].gives() * if alike < LEAST { 0.0 } else { alike };
            let weight = vec::min(both, rest);
            rest -= weight;
            color += flush(Vec3::from_array(other.color) * weight);
            variance += told(other.variance * square(luminance(weight)));
        }
        tap += 1;
    }
    color += flush(Vec3::from_array(own.color) * rest);
    variance += told(own.variance * square(luminance(rest)));
    Estimate { color: color.to_array(), variance }
}

impl Share {
    /// What it gives to others, but for their own scale.
    #[inline(always)]
    fn gives(&self) -> Vec3 {
        Vec3::from_array(self.scale) * self.reflectance.channels()
    }
}

#[inline(always)]
fn square(x: f32) -> f32 {
    x * x
}

/// A neighbour of a round: its index, how far away it is, and its weight in the kernel, which is 0 beyond the image and of the pixel itself.
#[inline(always)]
fn neighbour(params: &DenoiseParams, at: [u32; 2], tap: i32) -> (usize, Vec2, f32) {
    let (dx, dy) = (tap % 5 - 2, tap / 5 - 2);
    let step = params.step as i32;
    let (index, inside) = params.neighbour(at, dx.wrapping_mul(step), dy.wrapping_mul(step));
    let offset = Vec2::new(dx as f32, dy as f32) * params.step as f32;
    let weight = if inside & (tap != 12) { spline(dx) * spline(dy) } else { 0.0 };
    (index, offset, weight)
}

#[inline(always)]
fn spline(distance: i32) -> f32 {
    let [middle, next, far] = SPLINE;
    match distance {
        0 => middle,
        -1 | 1 => next,
        _ => far,
    }
}

/// Light, of a filtered pixel and what its surface gives back; of one that is not filtered the picture.
#[inline(always)]
pub fn modulate(picture: FilmPixel, guide: &Guide, track: &Track, filtered: &Estimate) -> FilmPixel {
    if !guide.exists() | !filtered.is_filtered() {
        return picture;
    }
    let light = Vec3::from_array(filtered.color) * track.reflectance.channels();
    FilmPixel { sum: flush(light).to_array(), ..picture }
}
