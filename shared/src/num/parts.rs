//! The parts of a number that the elementary functions are assembled from.

use super::abs;

/// ln 2 in two parts; products of the first with integers below 2^9 are exact.
pub(super) const LN_2_HI: f32 = 0.693_359_4;
pub(super) const LN_2_LO: f32 = -2.121_944_4e-4;

pub(super) const SIGN: u32 = 0x8000_0000;
pub(super) const INFINITY: u32 = 0x7f80_0000;
pub(super) const NAN: u32 = 0x7fc0_0000;

const SQRT_HALF: u32 = 0x3f35_04f3;
const ROUNDER: f32 = 12_582_912.0;

/// The integer in the low bits of `x + 1.5 2^23`: `x` rounded, for |x| < 2^22.
#[inline(always)]
pub(super) fn nearest(x: f32) -> i32 {
    ((x + ROUNDER).to_bits() as i32).wrapping_sub(ROUNDER.to_bits() as i32)
}

/// `x` rounded to an integer for |x| < 2^22: the integer as a number and as an `i32`.
#[inline(always)]
pub(super) fn round(x: f32) -> (f32, i32) {
    ((x + ROUNDER) - ROUNDER, nearest(x))
}

/// The sign bit of `x`.
#[inline(always)]
pub(super) fn sign(x: f32) -> u32 {
    x.to_bits() & SIGN
}

/// 2^k for k in [-126, 127]; zero for -127.
#[inline(always)]
pub(super) fn power_of_two(k: i32) -> f32 {
    f32::from_bits((k.wrapping_add(127) as u32) << 23)
}

/// y 2^k, where `y` and the result are normal numbers.
#[inline(always)]
pub(super) fn scale(y: f32, k: i32) -> f32 {
    f32::from_bits(y.to_bits().wrapping_add((k as u32) << 23))
}

/// The m in [sqrt(1/2), sqrt(2)) and k of a positive normal x = m 2^k.
#[inline(always)]
pub(super) fn mantissa(x: f32) -> (f32, i32) {
    let shifted = x.to_bits().wrapping_sub(SQRT_HALF);
    (f32::from_bits((shifted & 0x007f_ffff).wrapping_add(SQRT_HALF)), (shifted as i32) >> 23)
}

/// Whether `x` is a NaN, from its bits.
#[inline(always)]
pub(super) fn is_nan(x: f32) -> bool {
    abs(x).to_bits() > INFINITY
}
