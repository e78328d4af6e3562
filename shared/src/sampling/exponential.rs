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
    num::div(-num::ln_1p(-u), rate)
}

/// `rate exp(-rate t)` per length, for `t` >= 0.
#[inline(always)]
pub fn exponential_pdf(t: f32, rate: f32) -> f32 {
    rate * num::exp(-(rate * t))
}

/// The `u` of which [`sample_exponential`] makes the distance `t`.
#[inline(always)]
pub fn invert_exponential(t: f32, rate: f32) -> f32 {
    to_unit(-num::expm1(-(rate * t)))
}

/// A distance in [0, `t_max`] with density [`bounded_exponential_pdf`]; `u` in [0, 1), `rate` >= 0, `t_max` > 0.
#[inline(always)]
pub fn sample_bounded_exponential(u: f32, rate: f32, t_max: f32) -> f32 {
    let depth = rate * t_max;
    if depth < THIN {
        t_max * (u * (1.0 - 0.5 * depth * (1.0 - u)))
    } else {
        let absorbed = u * -num::expm1(-depth);
        // where little is left, what is left must not come from a difference
        let log = if absorbed > 0.5 { num::ln((1.0 - u) + u * num::exp(-depth)) } else { num::ln_1p(-absorbed) };
        num::min(num::div(-log, rate), t_max)
    }
}

/// `rate exp(-rate t) / (1 - exp(-rate t_max))` per length, for `t` in [0, `t_max`]; zero beyond.
#[inline(always)]
pub fn bounded_exponential_pdf(t: f32, rate: f32, t_max: f32) -> f32 {
    let depth = rate * t_max;
    let thin = depth < THIN;
    // depth / (1 - exp(-depth)) by its series
    let series = 1.0 + depth * (0.5 + depth * TWELFTH);
    let (scale, norm) = if thin { (series, t_max) } else { (rate, -num::expm1(-depth)) };
    let density = num::div(scale * num::exp(-(rate * t)), norm);
    if (t >= 0.0) & (t <= t_max) { density } else { 0.0 }
}

/// The `u` of which [`sample_bounded_exponential`] makes the distance `t`.
#[inline(always)]
pub fn invert_bounded_exponential(t: f32, rate: f32, t_max: f32) -> f32 {
    let depth = rate * t_max;
    let thin = depth < THIN;
    let (part, whole) = if thin { (t, t_max) } else { (num::expm1(-(rate * t)), num::expm1(-depth)) };
    let ratio = num::div(part, whole);
    to_unit(if thin { ratio * (1.0 + 0.5 * depth * (1.0 - ratio)) } else { ratio })
}
