//! Distances with an exponential density, unbounded and bounded to [0, t_max].
//!
//! Optical depths are often tiny, where `1 - exp(-x)` cancels; the forms here keep their relative accuracy.

use super::to_unit;
use crate::num;

/// Optical depth below which the bounded density is a line, to less than a rounding.
const THIN: f32 = 1.0 / 2048.0;
const TWELFTH: f32 = 1.0 / 12.0;

/// A distance with density [`exponential_pdf`]; `u` in [0, 1), `rate` > 0. It is at most 16.7 / `rate`, because the
/// largest `u` is 1 - 2^-24.
#[inline(always)]
pub fn sample_exponential(u: f32, rate: f32) -> f32 {
    num::div(-log1p(-u), rate)
}

/// `rate exp(-rate t)` per length, for `t` >= 0.
#[inline(always)]
pub fn exponential_pdf(t: f32, rate: f32) -> f32 {
    rate * num::exp(-(rate * t))
}

/// The `u` of which [`sample_exponential`] makes the distance `t`.
#[inline(always)]
pub fn invert_exponential(t: f32, rate: f32) -> f32 {
    to_unit(-expm1(-(rate * t)))
}

/// A distance in [0, `t_max`] with density [`bounded_exponential_pdf`]; `u` in [0, 1), `rate` >= 0, `t_max` > 0.
#[inline(always)]
pub fn sample_bounded_exponential(u: f32, rate: f32, t_max: f32) -> f32 {
    let depth = rate * t_max;
    if depth < THIN {
        t_max * (u * (1.0 - 0.5 * depth * (1.0 - u)))
    } else {
        num::min(num::div(-log1p(u * expm1(-depth)), rate), t_max)
    }
}

/// `rate exp(-rate t) / (1 - exp(-rate t_max))` per length, for `t` in [0, `t_max`]; zero beyond.
#[inline(always)]
pub fn bounded_exponential_pdf(t: f32, rate: f32, t_max: f32) -> f32 {
    let depth = rate * t_max;
    let thin = depth < THIN;
    // depth / (1 - exp(-depth)) by its series
    let series = 1.0 + depth * (0.5 + depth * TWELFTH);
    let (scale, norm) = if thin { (series, t_max) } else { (rate, -expm1(-depth)) };
    let density = num::div(scale * num::exp(-(rate * t)), norm);
    if (t >= 0.0) & (t <= t_max) { density } else { 0.0 }
}

/// The `u` of which [`sample_bounded_exponential`] makes the distance `t`.
#[inline(always)]
pub fn invert_bounded_exponential(t: f32, rate: f32, t_max: f32) -> f32 {
    let depth = rate * t_max;
    let thin = depth < THIN;
    let (part, whole) = if thin { (t, t_max) } else { (expm1(-(rate * t)), expm1(-depth)) };
    let ratio = num::div(part, whole);
    to_unit(if thin { ratio * (1.0 + 0.5 * depth * (1.0 - ratio)) } else { ratio })
}

/// ln(1 + x) for x >= -1: the rounding of `1 + x` is divided out (Kahan; Goldberg 1991, theorem 4).
#[inline(always)]
fn log1p(x: f32) -> f32 {
    let w = 1.0 + x;
    let rounded = w - 1.0;
    if rounded == 0.0 { x } else { num::ln(w) * num::div(x, rounded) }
}

/// e^x - 1 for x <= 0, in the same way.
#[inline(always)]
fn expm1(x: f32) -> f32 {
    let w = num::exp(x);
    let rounded = w - 1.0;
    if rounded == 0.0 {
        x
    } else if rounded == -1.0 {
        -1.0
    } else {
        num::div(rounded * x, num::ln(w))
    }
}
