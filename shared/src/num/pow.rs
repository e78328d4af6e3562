//! The power function.

use super::exponential::exp2_reduced;
use super::soft::recip_seed;
use super::{MIN_POSITIVE, abs, clamp, eft, parts, round};

/// 2 / ln 2 in two parts.
const TWO_LOG2_E_HI: f32 = 2.885_39;
const TWO_LOG2_E_LO: f32 = 3.851_926e-8;
/// Exponents of larger magnitude are as good as this one: they lead out of the range unless the base is 1.
const EXPONENT_MAX: f32 = 1_099_511_627_776.0;
/// Powers of two beyond this are out of the range.
const LOG2_MAX: f32 = 200.0;

/// log2 of a positive normal number as a sum of two, to about 2^-33 of the larger of its value and 1/4.
///
/// x = 2^k m / c with c one of 5/4, 1, 3/4, so that m is close to 1; then log2 m = 2 artanh(s) / ln 2 for
/// s = (m - 1) / (m + 1), |s| < 0.0875. The linear term is carried in two parts; the rest, s^3 P(s^2), is a minimax fit
/// with an error of 2^-39.
#[inline(always)]
fn log2_in_two_parts(x: f32) -> (f32, f32) {
    let (m, k) = parts::mantissa(x);
    // c - 1, and -log2 c in two parts, of which the first leaves room for k
    let (change, offset, offset_lo) = if m < 0.84 {
        (0.25, -0.321_929_93, 1.836_753_3e-6)
    } else if m > 1.19 {
        (-0.25, 0.415_039_06, -1.563_221_2e-6)
    } else {
        (0.0, 0.0, 0.0)
    };
    let (m, m_lo) = eft::two_sum(m, m * change);
    let n = m - 1.0;
    let (d, d_lo) = eft::two_sum(m, 1.0);
    let y = recip_seed(d);
    let s = n * y;
    let (p, p_error) = eft::two_prod(s, d);
    let s_lo = ((((n - p) - p_error) + m_lo) - s * (d_lo + m_lo)) * y;
    let z = s * s;
    let t = 4.164_059_8e-1;
    let t = t * z + 5.770_635_6e-1;
    let t = t * z + 9.617_967e-1;
    let (linear, linear_lo) = eft::two_prod(s, TWO_LOG2_E_HI);
    // d artanh(s) / ds = 1 + z + ...
    let slope = TWO_LOG2_E_HI + TWO_LOG2_E_HI * z;
    let rest = t * (z * s) + (s * TWO_LOG2_E_LO + s_lo * slope + offset_lo) + linear_lo;
    let (sum, sum_error) = eft::two_sum(k as f32 + offset, linear);
    eft::two_sum(sum, sum_error + rest)
}

/// 2^(p + e) for |p| <= [`LOG2_MAX`] and a small e; zero below the normal numbers, infinity above.
#[inline(always)]
fn exp2_of_two_parts(p: f32, e: f32) -> u32 {
    let (n, k) = round(p);
    let y = exp2_reduced((p - n) + e);
    let exponent = ((y.to_bits() >> 23) as i32).wrapping_add(k);
    if exponent < 1 {
        0
    } else if exponent > 254 {
        parts::INFINITY
    } else {
        parts::scale(y, k).to_bits()
    }
}

/// x^y for x >= 0; NaN below, and where an operand is a NaN. x^0 and 1^y are 1. Zero and infinity as a base give zero or
/// infinity. Subnormal operands count as zero, results below 2^-126 are zero.
///
/// 2^(y log2 x) with the product in two parts, so that the error does not grow with the result.
pub fn pow(x: f32, y: f32) -> f32 {
    let (log, log_lo) = log2_in_two_parts(clamp(x, MIN_POSITIVE, f32::MAX));
    let exponent = clamp(y, -EXPONENT_MAX, EXPONENT_MAX);
    let (p, p_error) = eft::two_prod(exponent, log);
    let inside = abs(p) <= LOG2_MAX;
    let e = if inside { p_error + exponent * log_lo } else { 0.0 };
    let power = exp2_of_two_parts(clamp(p, -LOG2_MAX, LOG2_MAX), e);
    let limit = (abs(x) < MIN_POSITIVE) | (x > f32::MAX);
    f32::from_bits(if (x <= -MIN_POSITIVE) | parts::is_nan(x) | parts::is_nan(y) {
        parts::NAN
    } else if limit & (abs(y) >= MIN_POSITIVE) {
        if (x > 1.0) == (y > 0.0) { parts::INFINITY } else { 0 }
    } else {
        power
    })
}
