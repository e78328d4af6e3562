//! Device forms of division and roots, from trusted operations alone, correctly rounded.
//!
//! Newton's iteration on a seed from an integer subtraction gives the result to within a few units in the last
//! place. The correction is then exact **in integers**: for an approximate quotient q of the mantissas a and b the
//! residual `a 2^k - q b` is small although its terms are not, so it is known from their low 32 bits, and one
//! rounded division of it by b moves q to the floor of the true quotient. The quotient carries one bit more than
//! the result, and it never is a tie, so adding that bit rounds to nearest. The roots work in the same way; where 1 / sqrt is a
//! whole number, the one below it rounds to the same.
//!
//! The corrections ([`div_mantissa`], [`recip_mantissa`], [`sqrt_mantissa`], [`rsqrt_mantissa`]) give the same bits for every seed
//! within [`SEED_SLACK`] of the true value: how a device rounds the seed's arithmetic does not matter.
//!
//! Conditions are joined by `|` and `&`, which become selects; `||` would become a branch each on the device.
//!
//! ```
//! use restir_shared::num::soft;
//!
//! // the forms of the device, run on the host, have the bits of its hardware
//! for x in [1.0_f32, 3.0, 0.7, 1.0e-30, 16_777_215.0] {
//!     assert_eq!(soft::div(2.0, x), 2.0 / x);
//!     assert_eq!(soft::recip(x), 1.0 / x);
//!     assert_eq!(soft::sqrt(x).to_bits(), restir_shared::num::sqrt(x).to_bits());
//! }
//! // 2^-126 is the smallest normal number, and a quotient below it is zero
//! assert_eq!(soft::div(2.0 * f32::MIN_POSITIVE, 2.0), f32::MIN_POSITIVE);
//! assert_eq!(soft::div(f32::MIN_POSITIVE, 2.0), 0.0);
//! ```

use super::mul_wide;
use super::parts::{INFINITY, NAN, SIGN, nearest};

/// How far a seed may be off, in units of the 25-bit result: 8 units in the last place of an f32, twice over.
pub const SEED_SLACK: u32 = 16;

const HIDDEN: u32 = 0x0080_0000;
const FRACTION: u32 = HIDDEN - 1;
const ONE: u32 = 0x3f80_0000;
/// The exponent of 1, in place.
const BIAS: u32 = 127 << 23;
// Literal quotients would be divisions on the device; constants are folded.
const TWO_POW_M17: f32 = 1.0 / 131_072.0;
const TWO_POW_M23: f32 = 1.0 / 8_388_608.0;
const TWO_POW_M25: f32 = 1.0 / 33_554_432.0;

#[inline(always)]
fn exponent(bits: u32) -> u32 {
    (bits >> 23) & 0xff
}

#[inline(always)]
fn mantissa(bits: u32) -> u32 {
    (bits & FRACTION) | HIDDEN
}

/// The number in [1, 2) with the mantissa of the given one.
#[inline(always)]
fn unit(bits: u32) -> f32 {
    f32::from_bits((bits & FRACTION) | ONE)
}

/// The bits of a number: `floor` is its mantissa with one bit more, which is rounded to nearest, and `shifted` its exponent in place, less the
/// [`HIDDEN`] bit that the mantissa brings along.
#[inline(always)]
fn assemble(shifted: u32, floor: u32) -> u32 {
    shifted.wrapping_add(floor.wrapping_add(1) >> 1)
}

/// The floor of a quotient of which `q` is the floor or one more: `rest`, what `q` leaves, is then negative. An `if` would be a branch on the device.
#[inline(always)]
fn settle(q: u32, rest: i32) -> u32 {
    q.wrapping_add((rest >> 31) as u32)
}

/// 1 / m for m in [1, 2), to about two units in the last place.
#[inline(always)]
pub(super) fn recip_seed(m: f32) -> f32 {
    let y = f32::from_bits(0x7ef3_11c7_u32.wrapping_sub(m.to_bits()));
    let y = y * (2.0 - m * y);
    let y = y * (2.0 - m * y);
    y * (2.0 - m * y)
}

/// 1 / sqrt(m) for m in [1, 4), to about three units in the last place.
#[inline(always)]
fn rsqrt_seed(m: f32) -> f32 {
    let h = 0.5 * m;
    let y = f32::from_bits(0x5f37_59df_u32.wrapping_sub(m.to_bits() >> 1));
    let y = y * (1.5 - h * y * y);
    let y = y * (1.5 - h * y * y);
    y * (1.5 - h * y * y)
}

/// A number in [1, 2), given by its bits, as an integer of 25 bits. A number that an inexact seed puts a few units in the last place outside of this
/// range gives an integer that is off by less than [`SEED_SLACK`].
#[inline(always)]
fn seed25(bits: u32) -> u32 {
    bits.wrapping_sub(ONE - HIDDEN) << 1
}

/// 1 if a < b, for mantissas.
#[inline(always)]
fn below(a: u32, b: u32) -> u32 {
    a.wrapping_sub(b) >> 31
}

/// floor(a 2^k / b) for 24-bit mantissas, k = 24 if a >= b and 25 otherwise, so that it has 25 bits.
///
/// `seed` is that value within [`SEED_SLACK`], `y` is 2^23 / b to 16 bits or more.
#[inline(always)]
pub fn div_mantissa(a: u32, b: u32, seed: u32, y: f32) -> u32 {
    let residual = (a << 24_u32.wrapping_add(below(a, b))).wrapping_sub(seed.wrapping_mul(b)) as i32;
    let step = nearest(residual as f32 * (y * TWO_POW_M23));
    let rest = residual.wrapping_sub(step.wrapping_mul(b as i32));
    settle(seed.wrapping_add(step as u32), rest)
}

/// floor(2^48 / m), in (2^24, 2^25], for m in [2^23, 2^24).
///
/// `seed` is that value within [`SEED_SLACK`], `y` is 2^23 / m to 16 bits or more.
#[inline(always)]
pub fn recip_mantissa(m: u32, seed: u32, y: f32) -> u32 {
    let residual = seed.wrapping_mul(m).wrapping_neg() as i32;
    let step = nearest(residual as f32 * (y * TWO_POW_M23));
    let rest = residual.wrapping_sub(step.wrapping_mul(m as i32));
    settle(seed.wrapping_add(step as u32), rest)
}

/// floor(sqrt(m 2^25)), 25 bits, for m in [2^23, 2^25): a mantissa, doubled for odd exponents.
///
/// `seed` is that value within [`SEED_SLACK`], `y` is 1 / sqrt(m 2^-23) to 16 bits or more.
#[inline(always)]
pub fn sqrt_mantissa(m: u32, seed: u32, y: f32) -> u32 {
    let residual = (m << 25).wrapping_sub(seed.wrapping_mul(seed)) as i32;
    let step = nearest(residual as f32 * (y * TWO_POW_M25));
    let twice = seed.wrapping_mul(2).wrapping_add(step as u32);
    let rest = residual.wrapping_sub(step.wrapping_mul(twice as i32));
    settle(seed.wrapping_add(step as u32), rest)
}

/// The largest integer below 2^25 / sqrt(m 2^-23), of 25 bits, for m in [2^23, 2^25).
///
/// `seed` is that value within [`SEED_SLACK`], `y` is `seed` 2^-25 to 16 bits or more.
#[inline(always)]
pub fn rsqrt_mantissa(m: u32, seed: u32, y: f32) -> u32 {
    // residual = 2^73 - seed^2 m, less 1, of which 64 bits are enough
    let (square_hi, square_lo) = mul_wide(seed, seed);
    let (carry, product_lo) = mul_wide(square_lo, m);
    let (hi, lo) = (!square_hi.wrapping_mul(m).wrapping_add(carry), !product_lo);
    let step = nearest(hi as i32 as f32 * (y * TWO_POW_M17));
    // rest = residual - m (step (2 seed + step)), of which only the sign matters
    let grow = step.wrapping_mul(seed.wrapping_mul(2).wrapping_add(step as u32) as i32);
    let (grown_hi, grown_lo) = mul_wide(grow as u32, m);
    // `grow` has a sign, which `mul_wide` takes for 2^32: the product is then too large by m 2^32
    let sign = (grow >> 31) as u32 & m;
    let borrow = if lo < grown_lo { 1 } else { 0 };
    let rest = hi.wrapping_sub(grown_hi).wrapping_add(sign).wrapping_sub(borrow) as i32;
    settle(seed.wrapping_add(step as u32), rest)
}

/// `a / b`, correctly rounded; subnormal operands count as zero and subnormal results are zero.
pub fn div(a: f32, b: f32) -> f32 {
    let (ua, ub) = (a.to_bits(), b.to_bits());
    let (ea, eb) = (exponent(ua), exponent(ub));
    let (ma, mb) = (mantissa(ua), mantissa(ub));
    let less = below(ma, mb);
    let y = recip_seed(unit(ub));
    // twice the quotient where that is below 1
    let seed = seed25((unit(ua) * y).to_bits().wrapping_add(less << 23));
    let e = ea.wrapping_sub(eb).wrapping_add(127).wrapping_sub(less) as i32;
    let r = assemble((e << 23).wrapping_sub(HIDDEN as i32) as u32, div_mantissa(ma, mb, seed, y));
    let (vanishes, grows) = ((ea == 0) | (eb == 255), (ea == 255) | (eb == 0));
    let r = if (e <= 0) | vanishes { 0 } else { r };
    let r = if (e >= 255) | grows { INFINITY } else { r };
    let r = if (vanishes & grows) | is_nan(ua) | is_nan(ub) { NAN } else { r };
    f32::from_bits(r | ((ua ^ ub) & SIGN))
}

/// `1 / x`, correctly rounded; a subnormal operand counts as zero and a subnormal result is zero.
pub fn recip(x: f32) -> f32 {
    let u = x.to_bits();
    let e = u & INFINITY;
    let y = recip_seed(unit(u));
    // twice the seed, which is below 1
    let seed = seed25(y.to_bits().wrapping_add(HIDDEN));
    // A mantissa quotient of exactly 1 carries into the exponent, which is negative if x is not finite.
    let r = assemble((2 * BIAS - 2 * HIDDEN).wrapping_sub(e), recip_mantissa(mantissa(u), seed, y));
    let r = if (r as i32) < HIDDEN as i32 { 0 } else { r };
    let r = if e == 0 { INFINITY } else { r };
    let r = if is_nan(u) { NAN } else { r };
    f32::from_bits(r | (u & SIGN))
}

/// The square root of `x`, correctly rounded; a subnormal operand counts as zero; NaN for `x < 0`.
pub fn sqrt(x: f32) -> f32 {
    let u = x.to_bits();
    let m = even_mantissa(u);
    let scaled = scale_to_1_4(m);
    let y = rsqrt_seed(scaled);
    let s = sqrt_mantissa(m, seed25((scaled * y).to_bits()), y);
    let r = assemble((half_exponent(u) << 23).wrapping_sub(HIDDEN), s);
    let (zero, special) = (u & SIGN, if u == INFINITY { INFINITY } else { NAN });
    // numbers with a sign are the larger integers
    let r = if u >= INFINITY { special } else { r };
    f32::from_bits(if exponent(u) == 0 { zero } else { r })
}

/// `1 / sqrt(x)`, correctly rounded; infinity for zero or a subnormal, NaN for `x < 0`.
pub fn rsqrt(x: f32) -> f32 {
    let u = x.to_bits();
    let m = even_mantissa(u);
    let y = rsqrt_seed(scale_to_1_4(m));
    let s = rsqrt_mantissa(m, seed25(y.to_bits().wrapping_add(HIDDEN)), y);
    let r = assemble((2 * BIAS - HIDDEN).wrapping_sub(half_exponent(u) << 23).wrapping_sub(HIDDEN), s);
    let special = if u == INFINITY { 0 } else { NAN };
    let r = if u >= INFINITY { special } else { r };
    f32::from_bits(if exponent(u) == 0 { INFINITY } else { r })
}

/// m of a positive x = m 2^-23 4^h with m in [2^23, 2^25).
#[inline(always)]
fn even_mantissa(bits: u32) -> u32 {
    mantissa(bits) << (!(bits >> 23) & 1)
}

/// h + 127 of the same number.
#[inline(always)]
fn half_exponent(bits: u32) -> u32 {
    bits.wrapping_add(BIAS) >> 24
}

/// m 2^-23 for m in [2^23, 2^25); exact, because an m of 25 bits is even.
#[inline(always)]
fn scale_to_1_4(m: u32) -> f32 {
    m as f32 * TWO_POW_M23
}

#[inline(always)]
fn is_nan(bits: u32) -> bool {
    bits & !SIGN > INFINITY
}
