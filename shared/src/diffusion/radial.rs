//! The profile of one channel over the distance, and distances of its density.
//!
//! With x = r / d, `w = exp(-x / 3)` and `v = 1 - w`, more light than `u = w (w^2 + 3) / 4` comes out beyond x, and `1 - u =
//! v (6 - 3 v + v^2) / 4` nearer. Either form keeps its digits where the other has lost them, and so does the root of each.

use crate::num::{INV_PI, UNIT_ROUNDOFF, clamp, div, exp, expm1, flush, ln, ln_1p, max, min};

/// Where a profile ends, in units of `d`.
pub const REACH: f32 = 19.860_221;
/// The part of a profile that would come out beyond [`REACH`].
pub const TAIL: f32 = 1.0e-3;
const WITHIN: f32 = 1.0 - TAIL;
/// Nearer than this, in units of `d`, a profile is as high as there: it grows beyond all limits, and so does its density.
pub(super) const NEAREST: f32 = 1.0e-5;
pub(super) const INV_8_PI: f32 = 0.125 * INV_PI;
const THIRD: f32 = 1.0 / 3.0;

/// `Rd(r; d)` per area, for `d` > 0, also beyond [`REACH`].
#[inline(always)]
pub fn radial_profile(r: f32, d: f32) -> f32 {
    let w = falloff(div(r, d));
    div(INV_8_PI * (w * (1.0 + w * w)), d * max(r, NEAREST * d))
}

/// `exp(-x / 3)`.
#[inline(always)]
pub(super) fn falloff(x: f32) -> f32 {
    flush(exp(-(x * THIRD)))
}

/// The part of the light that comes out nearer than `x` = r / d.
#[inline(always)]
pub fn cdf(x: f32) -> f32 {
    let v = -expm1(-(x * THIRD));
    0.25 * (v * (6.0 + v * (v - 3.0)))
}

/// The part of the light that comes out beyond `x` = r / d.
#[inline(always)]
pub fn ccdf(x: f32) -> f32 {
    let w = falloff(x);
    0.25 * (w * (w * w + 3.0))
}

/// A distance in units of `d` up to [`REACH`], with the radial density of the profile over `1 - TAIL`; `u` in [0, 1).
///
/// Zero gives [`REACH`]: numbers close to zero are finer than those close to one, and far away it takes finer ones to tell distances
/// apart.
#[inline(always)]
pub fn sample_radius(u: f32) -> f32 {
    let near = u >= 0.5;
    // v of what comes out nearer, or w of what comes out beyond
    let part = if near { WITHIN * (1.0 - u) } else { TAIL + WITHIN * u };
    let (a, b) = if near { (6.0, -3.0) } else { (3.0, 0.0) };
    let first = div(4.0 * part, a);
    let square = first * first;
    let mut root = first * if near { 1.0 + 0.5 * first } else { 1.0 - THIRD * (square - square * square) };
    let mut step = 0;
    while step < 2 {
        let rest = root * (a + root * (b + root)) - 4.0 * part;
        root -= div(rest, a + root * (2.0 * b + 3.0 * root));
        step += 1;
    }
    min(-3.0 * if near { ln_1p(-root) } else { ln(root) }, REACH)
}

/// The `u` of which [`sample_radius`] makes the distance `x`.
#[inline(always)]
pub fn invert_radius(x: f32) -> f32 {
    let nearer = cdf(x);
    let u = if nearer < 0.5 { 1.0 - div(nearer, WITHIN) } else { div(ccdf(x) - TAIL, WITHIN) };
    clamp(u, 0.0, 1.0 - UNIT_ROUNDOFF)
}
