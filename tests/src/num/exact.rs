//! Correctly rounded division and roots in integer arithmetic.
//!
//! As in [`restir_shared::num::soft`] subnormal operands count as zero and subnormal results are zero.

use super::accuracy::power_of_two;

const HIDDEN: u32 = 0x0080_0000;

/// A finite number without its sign: `mantissa` 2^(`exponent` - 23), mantissa in [2^23, 2^24).
#[derive(Clone, Copy)]
struct Parts {
    mantissa: u64,
    exponent: i32,
}

/// `None` for zero, infinity, NaN.
fn parts(x: f32) -> Option<Parts> {
    let x = flush(x);
    (x.is_finite() && x != 0.0).then(|| Parts {
        mantissa: u64::from((x.to_bits() & (HIDDEN - 1)) | HIDDEN),
        exponent: ((x.to_bits() >> 23) & 0xff) as i32 - 127,
    })
}

/// `x`, or a zero of its sign if it is subnormal.
pub fn flush(x: f32) -> f32 {
    if x.is_subnormal() { 0.0_f32.copysign(x) } else { x }
}

/// A floor with one bit more than the result, rounded half to even; `exact` if nothing lies below that bit.
fn round(floor: u64, exact: bool) -> u64 {
    let up = floor & 1 == 1 && (!exact || floor & 2 == 2);
    (floor >> 1) + u64::from(up)
}

/// `mantissa` 2^(`exponent` - 23), an `f32` or out of range; zero below the normal numbers.
fn assemble(mantissa: u64, exponent: i32) -> f32 {
    // exact in f64, so that the conversion rounds nothing but overflow
    let value = mantissa as f64 * power_of_two(exponent - 23);
    if value < f64::from(f32::MIN_POSITIVE) { 0.0 } else { value as f32 }
}

/// floor(a 2^k / b) for 24-bit mantissas, k = 24 if a >= b and 25 otherwise.
pub fn div_floor(a: u32, b: u32) -> u32 {
    let shift = if a < b { 25 } else { 24 };
    ((u64::from(a) << shift) / u64::from(b)) as u32
}

/// floor(2^48 / m).
pub fn recip_floor(m: u32) -> u32 {
    ((1_u64 << 48) / u64::from(m)) as u32
}

/// floor(sqrt(m 2^25)).
pub fn sqrt_floor(m: u32) -> u32 {
    (u64::from(m) << 25).isqrt() as u32
}

/// floor(2^25 / sqrt(m 2^-23)).
pub fn rsqrt_floor(m: u32) -> u32 {
    // the floor inside does not change the floor outside
    ((1_u128 << 73) / u128::from(m)).isqrt() as u32
}

/// `a / b`.
pub fn div(a: f32, b: f32) -> f32 {
    let (a, b) = (flush(a), flush(b));
    let (Some(pa), Some(pb)) = (parts(a), parts(b)) else {
        // zeros, infinities and NaN: no rounding
        return a / b;
    };
    let less = pa.mantissa < pb.mantissa;
    let floor = div_floor(pa.mantissa as u32, pb.mantissa as u32);
    let dividend = pa.mantissa << if less { 25 } else { 24 };
    let exact = u64::from(floor) * pb.mantissa == dividend;
    let exponent = pa.exponent - pb.exponent - i32::from(less);
    let sign = 1.0_f32.copysign(a) * 1.0_f32.copysign(b);
    assemble(round(u64::from(floor), exact), exponent).copysign(sign)
}

/// `1 / x`.
pub fn recip(x: f32) -> f32 {
    div(1.0, x)
}

/// The mantissa, doubled for an odd exponent, and half the exponent.
fn even(p: Parts) -> (u32, i32) {
    let odd = p.exponent & 1;
    ((p.mantissa << odd) as u32, (p.exponent - odd) / 2)
}

/// The square root; NaN below zero.
pub fn sqrt(x: f32) -> f32 {
    match parts(x) {
        Some(_) if x < 0.0 => f32::NAN,
        Some(p) => {
            let (m, half) = even(p);
            let floor = u64::from(sqrt_floor(m));
            assemble(round(floor, floor * floor == u64::from(m) << 25), half)
        }
        None if x == f32::NEG_INFINITY => f32::NAN,
        None => flush(x),
    }
}

/// `1 / sqrt(x)`; infinity for a zero of either sign, NaN below zero.
pub fn rsqrt(x: f32) -> f32 {
    match parts(x) {
        Some(_) if x < 0.0 => f32::NAN,
        Some(p) => {
            let (m, half) = even(p);
            let floor = rsqrt_floor(m);
            let exact = u128::from(floor).pow(2) * u128::from(m) == 1 << 73;
            assemble(round(u64::from(floor), exact), -half - 1)
        }
        None if flush(x) == 0.0 => f32::INFINITY,
        None if x == f32::INFINITY => 0.0,
        None => f32::NAN,
    }
}
