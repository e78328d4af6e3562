//! Exponential, logarithm, sine and cosine: one polynomial for both sides. Coefficients after Cephes
//! (S. L. Moshier), angles rescaled to turns.

use super::{EXP_MAX, EXP_MIN, clamp};

const LOG2_E: f32 = core::f32::consts::LOG2_E;
/// ln 2 in two parts; products of the first with integers below 2^9 are exact.
const LN_2_HI: f32 = 0.693_359_4;
const LN_2_LO: f32 = -2.121_944_4e-4;
const SQRT_HALF_BITS: u32 = 0x3f35_04f3;
const INFINITY: u32 = 0x7f80_0000;
const NAN: u32 = 0x7fc0_0000;
const ROUNDER: f32 = 12_582_912.0;

/// `x` rounded to an integer for |x| < 2^22: the integer as a number and as an `i32`.
#[inline(always)]
fn round(x: f32) -> (f32, i32) {
    let t = x + ROUNDER;
    (t - ROUNDER, (t.to_bits() as i32).wrapping_sub(ROUNDER.to_bits() as i32))
}

/// 2^e for e in [-126, 127].
#[inline(always)]
fn power_of_two(e: i32) -> f32 {
    f32::from_bits((e.wrapping_add(127) as u32) << 23)
}

/// e^x. Domain [[`EXP_MIN`], [`EXP_MAX`]]; zero below, infinity above, NaN for NaN.
pub fn exp(x: f32) -> f32 {
    let limited = clamp(x, EXP_MIN, EXP_MAX);
    let (k, e) = round(limited * LOG2_E);
    let r = (limited - k * LN_2_HI) - k * LN_2_LO;
    let p = 1.987_569_2e-4;
    let p = p * r + 1.398_199_9e-3;
    let p = p * r + 8.333_452e-3;
    let p = p * r + 4.166_579_6e-2;
    let p = p * r + 1.666_666_5e-1;
    let p = p * r + 0.5;
    let y = p * (r * r) + r + 1.0;
    // in two steps, because 2^128 is no f32
    let half = e >> 1;
    let y = y * power_of_two(half) * power_of_two(e.wrapping_sub(half));
    // chosen among bits, for some shading languages have no literal infinity
    f32::from_bits(if x < EXP_MIN {
        0
    } else if x > EXP_MAX {
        INFINITY
    } else if x >= EXP_MIN {
        y.to_bits()
    } else {
        NAN
    })
}

/// The natural logarithm. Domain: positive normal numbers; minus infinity for zero and subnormals, NaN below.
pub fn ln(x: f32) -> f32 {
    // x = m 2^k with m in [sqrt(1/2), sqrt(2))
    let shifted = x.to_bits().wrapping_sub(SQRT_HALF_BITS);
    let k = (shifted as i32) >> 23;
    let m = f32::from_bits((shifted & 0x007f_ffff).wrapping_add(SQRT_HALF_BITS));
    let f = m - 1.0;
    let z = f * f;
    let p = 7.037_683_6e-2;
    let p = p * f - 1.151_461e-1;
    let p = p * f + 1.167_699_9e-1;
    let p = p * f - 1.242_014_1e-1;
    let p = p * f + 1.424_932_3e-1;
    let p = p * f - 1.666_805_8e-1;
    let p = p * f + 2.000_071_5e-1;
    let p = p * f - 2.499_999_4e-1;
    let p = p * f + 3.333_333e-1;
    let e = k as f32;
    let y = p * (f * z) + e * LN_2_LO;
    let y = f + (y - 0.5 * z);
    let y = y + e * LN_2_HI;
    f32::from_bits(if x.to_bits() == INFINITY {
        INFINITY
    } else if x >= super::MIN_POSITIVE {
        y.to_bits()
    } else if x > -super::MIN_POSITIVE {
        INFINITY | 0x8000_0000
    } else {
        NAN
    })
}

/// (sin, cos) of an angle in turns: of `2 pi u`. Domain |u| <= [`super::TURNS_MAX`].
/// Below 2^-100 the last bit may differ where subnormal numbers are flushed.
///
/// The reduction to an eighth of a turn is exact, which is why angles are in turns: random numbers already are.
pub fn sin_cos(u: f32) -> (f32, f32) {
    let (k, quadrant) = round(u * 4.0);
    let r = u - k * 0.25;
    let z = r * r;
    let p = -75.445_656;
    let p = p * z + 81.593_766;
    let p = p * z - 41.341_67;
    // 2 pi in two parts
    let sin = r * 6.283_185_5 + (p * (z * r) - r * 1.748_455_5e-7);
    let p = 59.349_7;
    let p = p * z - 85.447_14;
    let p = p * z + 64.939_36;
    let p = p * z - 19.739_208;
    let cos = p * z + 1.0;
    let (a, b) = if quadrant & 1 == 0 { (sin, cos) } else { (cos, sin) };
    (if quadrant & 2 == 0 { a } else { -a }, if quadrant.wrapping_add(1) & 2 == 0 { b } else { -b })
}
