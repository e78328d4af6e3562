//! Exponentials and the hyperbolic sine: one polynomial for both sides.

use super::{EXP_MAX, EXP_MIN, EXP2_MAX, EXP2_MIN, SINH_MAX, abs, clamp, min, parts, round};

const LOG2_E: f32 = core::f32::consts::LOG2_E;
/// Below this argument e^x - 1 is -1.
const EXPM1_MIN: f32 = -20.0;

/// The integer k and the rest r of x = k ln 2 + r, |r| <= ln 2 / 2.
#[inline(always)]
fn reduce(x: f32) -> (i32, f32) {
    let (n, k) = round(x * LOG2_E);
    (k, (x - n * parts::LN_2_HI) - n * parts::LN_2_LO)
}

/// e^r - 1 for |r| <= ln 2 / 2. Coefficients after Cephes (S. L. Moshier).
#[inline(always)]
fn expm1_reduced(r: f32) -> f32 {
    let p = 1.987_569_2e-4;
    let p = p * r + 1.398_199_9e-3;
    let p = p * r + 8.333_452e-3;
    let p = p * r + 4.166_579_6e-2;
    let p = p * r + 1.666_666_5e-1;
    let p = p * r + 0.5;
    p * (r * r) + r
}

/// 2^r for |r| <= 1/2. Coefficients by a minimax fit of (2^r - 1) / r, relative error of the result 2^-28.3.
#[inline(always)]
pub(super) fn exp2_reduced(r: f32) -> f32 {
    let p = 1.532_926_4e-4;
    let p = p * r + 1.339_096_9e-3;
    let p = p * r + 9.618_499e-3;
    let p = p * r + 5.550_359_6e-2;
    let p = p * r + 2.402_264_8e-1;
    let p = p * r + 6.931_472e-1;
    p * r + 1.0
}

/// `y` for `x` in [lo, hi], zero below, infinity above, NaN for a NaN.
#[inline(always)]
fn within(x: f32, lo: f32, hi: f32, y: f32) -> f32 {
    // chosen among bits, for some shading languages have no literal infinity
    f32::from_bits(if x < lo {
        0
    } else if x > hi {
        parts::INFINITY
    } else if x >= lo {
        y.to_bits()
    } else {
        parts::NAN
    })
}

/// e^x. Domain [[`EXP_MIN`], [`EXP_MAX`]]; zero below, infinity above, NaN for NaN.
pub fn exp(x: f32) -> f32 {
    let (k, r) = reduce(clamp(x, EXP_MIN, EXP_MAX));
    within(x, EXP_MIN, EXP_MAX, parts::scale(expm1_reduced(r) + 1.0, k))
}

/// 2^x. Domain [[`EXP2_MIN`], [`EXP2_MAX`]]; zero below, infinity above, NaN for NaN. Exact for integers.
pub fn exp2(x: f32) -> f32 {
    let limited = clamp(x, EXP2_MIN, EXP2_MAX);
    let (n, k) = round(limited);
    within(x, EXP2_MIN, EXP2_MAX, parts::scale(exp2_reduced(limited - n), k))
}

/// e^x - 1 without cancellation. Domain: up to [`EXP_MAX`]; infinity above, NaN for NaN, zero for a zero of either
/// sign. An argument below 2^-126 counts as zero.
pub fn expm1(x: f32) -> f32 {
    let (k, r) = reduce(clamp(x, EXPM1_MIN, EXP_MAX));
    let e = expm1_reduced(r);
    // half of 2^k (e + 1) - 1, because 2^128 is no f32
    let half = parts::power_of_two(k.wrapping_sub(1));
    let y = (half * e + (half - 0.5)) * 2.0;
    let y = if k == 0 { e } else { y };
    f32::from_bits(if x > EXP_MAX {
        parts::INFINITY
    } else if x <= EXP_MAX {
        y.to_bits()
    } else {
        parts::NAN
    })
}

/// The hyperbolic sine. Domain: magnitudes up to [`SINH_MAX`]; infinity of the argument's sign beyond, NaN for NaN.
///
/// Up to 1 an odd polynomial; beyond, with x = k ln 2 + r, from sinh r and cosh r, which needs no division for the
/// decaying half. Coefficients by minimax fits, relative errors 2^-32 and 2^-33.
pub fn sinh(x: f32) -> f32 {
    let a = abs(x);
    let limited = min(a, SINH_MAX);
    let (k, r) = reduce(limited);
    let small = limited < 1.0;
    let t = if small { limited } else { r };
    let z = t * t;
    let p = 2.782_213_2e-6;
    let p = p * z + 1.984_289_6e-4;
    let p = p * z + 8.333_31e-3;
    let p = p * z + 1.666_666_7e-1;
    let sinh = p * (z * t) + t;
    let q = 1.393_542_2e-3;
    let q = q * z + 4.166_646e-2;
    let q = q * z + 0.5;
    let cosh_m1 = q * z;
    // half of 2^k e^r / 2 - 2^-k e^-r / 2, because 2^128 is no f32; the decaying half is lost long before 2^-124
    let growing = parts::power_of_two(k.wrapping_sub(2));
    let decaying = parts::power_of_two(if k < 120 { (-2_i32).wrapping_sub(k) } else { -122 });
    let (sum, difference) = (growing + decaying, growing - decaying);
    let y = (difference + (difference * cosh_m1 + sum * sinh)) * 2.0;
    let y = if small { sinh } else { y };
    f32::from_bits(if a > SINH_MAX {
        parts::INFINITY | parts::sign(x)
    } else if a <= SINH_MAX {
        y.to_bits() | parts::sign(x)
    } else {
        parts::NAN
    })
}
