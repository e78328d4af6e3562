//! Places in the four-term Blackman-Harris window (Harris 1978, table 1: side lobes at -92 dB), as a density: the filter of pixels that
//! others have as well (pbrt-v4, Cycles).

use super::to_unit;
use crate::num;

/// The window's coefficients.
const A: [f64; 4] = [0.358_75, 0.488_29, 0.141_28, 0.011_68];
/// Those of its integral over the mean: of sin(2 pi k x).
const S: [f64; 3] = [A[1] / (TAU * A[0]), A[2] / (2.0 * TAU * A[0]), A[3] / (3.0 * TAU * A[0])];
const TAU: f64 = core::f64::consts::TAU;

// With d the distance from the nearer end, v = 1 - cos(2 pi d) and s = sin(2 pi d), the density is a polynomial in v with positive
// coefficients, which keeps the relative accuracy of its small ends, and the distribution function d - s times another.
const PDF: [f32; 4] = [
    ((A[0] - A[1] + A[2] - A[3]) / A[0]) as f32,
    ((A[1] - 4.0 * A[2] + 9.0 * A[3]) / A[0]) as f32,
    ((2.0 * A[2] - 12.0 * A[3]) / A[0]) as f32,
    (4.0 * A[3] / A[0]) as f32,
];
const CDF: [f32; 3] = [(S[0] - 2.0 * S[1] + 3.0 * S[2]) as f32, (2.0 * S[1] - 8.0 * S[2]) as f32, (4.0 * S[2]) as f32];

/// A parabola in `sqrt(-2 ln u)` that is the distance from the end to 0.0065, in the least squares of `u` from 2^-25 to 1/2.
const GUESS: [f32; 3] = [0.7933, -0.2707, 0.0230];
/// Newton's steps from there, which leave 1.4 cells of random numbers.
const STEPS: u32 = 2;
/// Random numbers are multiples of it.
const CELL: f32 = num::UNIT_ROUNDOFF;

/// Density and distribution function at a distance in [0, 1/2] from the end.
#[inline(always)]
fn window(d: f32) -> [f32; 2] {
    let (sin, cos) = num::sin_cos(d * 0.5);
    let (v, s) = (2.0 * sin * sin, 2.0 * sin * cos);
    let density = PDF[0] + v * (PDF[1] + v * (PDF[2] + v * PDF[3]));
    [density, d - s * (CDF[0] + v * (CDF[1] + v * CDF[2]))]
}

/// A place in [-1/2, 1/2] with density [`blackman_harris_pdf`]; `u` in [0, 1), a multiple of 2^-24, of whose cell it takes the middle,
/// so that `1 - 2^-24 - u` gives the same place with the other sign.
#[inline(always)]
pub fn sample_blackman_harris(u: f32) -> f32 {
    let lower = u < 0.5;
    let tail = if lower { u } else { (1.0 - u) - CELL } + 0.5 * CELL;
    let y = num::sqrt(-2.0 * num::ln(tail));
    let mut d = GUESS[0] + y * (GUESS[1] + y * GUESS[2]);
    let mut step = 0;
    while step < STEPS {
        let [density, below] = window(d);
        d = num::clamp(d - num::div(below - tail, density), 0.0, 0.5);
        step += 1;
    }
    if lower { d - 0.5 } else { 0.5 - d }
}

/// The window over its mean, per length, at a place in [-1/2, 1/2]; zero beyond.
#[inline(always)]
pub fn blackman_harris_pdf(x: f32) -> f32 {
    let [density, _] = window(0.5 - num::abs(x));
    if num::abs(x) <= 0.5 { density } else { 0.0 }
}

/// The `u` of which [`sample_blackman_harris`] makes the place `x`, not rounded to a multiple of 2^-24.
#[inline(always)]
pub fn invert_blackman_harris(x: f32) -> f32 {
    let [_, tail] = window(num::clamp(0.5 - num::abs(x), 0.0, 0.5));
    to_unit(if x < 0.0 { tail } else { 1.0 - tail })
}
