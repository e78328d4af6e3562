//! Host forms: the hardware's instructions where IEEE 754 fixes their result.
#![expect(clippy::disallowed_methods, reason = "the correctly rounded hardware square root")]

extern crate std;

#[inline(always)]
pub(super) fn div(a: f32, b: f32) -> f32 {
    a / b
}

#[inline(always)]
pub(super) fn recip(x: f32) -> f32 {
    1.0 / x
}

#[inline(always)]
pub(super) fn sqrt(x: f32) -> f32 {
    x.sqrt()
}

/// Through f64: that no result lies so close to a midpoint that the double rounding shows is checked
/// exhaustively (`cargo lab num`).
#[inline(always)]
pub(super) fn rsqrt(x: f32) -> f32 {
    if x == 0.0 { f32::INFINITY } else { (1.0 / f64::from(x).sqrt()) as f32 }
}
