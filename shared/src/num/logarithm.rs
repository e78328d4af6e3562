//! Logarithms and the inverse hyperbolic sine: one polynomial for both sides, after Cephes (S. L. Moshier).

use super::{MIN_POSITIVE, abs, eft, parts, sqrt};

const LOG2_E: f32 = core::f32::consts::LOG2_E;
/// Beyond this, sqrt(x^2 + 1) is x to less than a twentieth of a unit in the last place of the logarithm.
const ASINH_LARGE: f32 = 4096.0;

/// ln(1 + f) - f + z / 2 for f in [sqrt(1/2) - 1, sqrt(2) - 1) and z = f^2.
#[inline(always)]
fn cubic(f: f32, z: f32) -> f32 {
    let p = 7.037_683_6e-2;
    let p = p * f - 1.151_461e-1;
    let p = p * f + 1.167_699_9e-1;
    let p = p * f - 1.242_014_1e-1;
    let p = p * f + 1.424_932_3e-1;
    let p = p * f - 1.666_805_8e-1;
    let p = p * f + 2.000_071_5e-1;
    let p = p * f - 2.499_999_4e-1;
    let p = p * f + 3.333_333e-1;
    p * (f * z)
}

/// ln((1 + f) 2^k).
#[inline(always)]
fn ln_reduced(f: f32, k: i32) -> f32 {
    let z = f * f;
    let n = k as f32;
    let y = cubic(f, z) + n * parts::LN_2_LO;
    let y = f + (y - 0.5 * z);
    y + n * parts::LN_2_HI
}

/// `f`, corrected for the rounding error `lo` of the number m 2^k = (1 + f) 2^k that it comes from.
#[inline(always)]
fn refine(f: f32, k: i32, lo: f32) -> f32 {
    // from 2^32 on the error is of no account, and the power would leave the range
    if k < 32 { f + lo * parts::power_of_two(k.wrapping_neg()) } else { f }
}

/// The `y` of a positive normal `x`; infinity for infinity, minus infinity for zero and subnormals, NaN below.
#[inline(always)]
fn of_positive(x: f32, y: f32) -> f32 {
    f32::from_bits(if x.to_bits() == parts::INFINITY {
        parts::INFINITY
    } else if x >= MIN_POSITIVE {
        y.to_bits()
    } else if x > -MIN_POSITIVE {
        parts::INFINITY | parts::SIGN
    } else {
        parts::NAN
    })
}

/// The natural logarithm. Domain: positive normal numbers; minus infinity for zero and subnormals, NaN below.
pub fn ln(x: f32) -> f32 {
    let (m, k) = parts::mantissa(x);
    of_positive(x, ln_reduced(m - 1.0, k))
}

/// The logarithm to base 2. Domain: positive normal numbers; minus infinity for zero and subnormals, NaN below. Exact
/// for powers of two.
pub fn log2(x: f32) -> f32 {
    let (m, k) = parts::mantissa(x);
    let f = m - 1.0;
    let z = f * f;
    let tail = cubic(f, z) - 0.5 * z;
    // log2(e) = 1 + 0.44...: the larger product is exact
    let y = f + (f * (LOG2_E - 1.0) + tail * LOG2_E);
    of_positive(x, y + k as f32)
}

/// ln(1 + x) without cancellation. Domain: above -1; minus infinity at -1, NaN below, zero for a zero of either sign.
/// An argument below 2^-126 counts as zero.
pub fn ln_1p(x: f32) -> f32 {
    let (u, lo) = eft::two_sum(1.0, x);
    let (m, k) = parts::mantissa(u);
    let f = if k == 0 { x } else { refine(m - 1.0, k, lo) };
    of_positive(u, ln_reduced(f, k))
}

/// The inverse hyperbolic sine. Domain: all numbers; infinities and NaN as they are.
///
/// Up to 1 an odd polynomial (minimax fit, relative error 2^-30.8), beyond the logarithm of x + sqrt(x^2 + 1).
pub fn asinh(x: f32) -> f32 {
    let a = abs(x);
    let z = a * a;
    let p = -3.882_153e-4;
    let p = p * z + 2.398_542_6e-3;
    let p = p * z - 7.021_291e-3;
    let p = p * z + 1.358_569_4e-2;
    let p = p * z - 2.099_347_9e-2;
    let p = p * z + 3.006_123_4e-2;
    let p = p * z - 4.459_935_4e-2;
    let p = p * z + 7.499_705e-2;
    let p = p * z - 1.666_666e-1;
    let small = p * (z * a) + a;
    // half the logarithm's argument, because twice the largest number is none
    let root = 0.5 * if a > ASINH_LARGE { a } else { sqrt(z + 1.0) };
    let sum = root + 0.5 * a;
    let lo = 0.5 * a - (sum - root);
    let (m, k) = parts::mantissa(sum);
    let large = ln_reduced(refine(m - 1.0, k, lo), k.wrapping_add(1));
    let y = if a < 1.0 { small } else { large };
    f32::from_bits(if a.to_bits() < parts::INFINITY { y.to_bits() | parts::sign(x) } else { x.to_bits() })
}
