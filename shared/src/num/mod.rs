//! The only home of non-trivial scalar functions.
//!
//! Each is built from the operations that both IEEE 754 and Vulkan fix (`+ - *`, comparisons, bit casts, 32-bit
//! integers), so that host and device give the same bits. Where IEEE 754 fixes the answer (division, roots)
//! the host uses its hardware and the device the forms of [`soft`], which equal it.
//!
//! Subnormal numbers are outside the contract: operands of magnitude below 2^-126 count as zero, results
//! below it are zero on the device. The bits of a NaN are unspecified. DETERMINISM.md has the measured errors.
//!
//! ```
//! use restir_shared::num::{acos, cbrt, div, exp, sin_cos, sqrt};
//!
//! // division and roots are correctly rounded, as the operators of the host are
//! assert_eq!(div(1.0, 3.0), 1.0_f32 / 3.0);
//! assert_eq!(sqrt(2.0), core::f32::consts::SQRT_2);
//!
//! // angles are in turns, of which four quarters make a circle, so that 1/4 has an exact sine and cosine
//! assert_eq!(sin_cos(0.25), (1.0, 0.0));
//! assert_eq!(acos(-1.0), 0.5);
//!
//! // the other functions have the same bits on every device, and errors of a few units in the last place
//! assert!((cbrt(27.0) - 3.0).abs() < 1e-6 && (exp(1.0) - core::f32::consts::E).abs() < 1e-6);
//! ```

mod atan2;
mod cbrt;
#[doc(hidden)]
pub mod eft;
#[cfg_attr(all(target_arch = "spirv", feature = "fast"), allow(dead_code, unreachable_pub))]
mod exponential;
mod floor;
#[cfg_attr(all(target_arch = "spirv", feature = "fast"), allow(dead_code, unreachable_pub))]
mod logarithm;
#[cfg_attr(all(target_arch = "spirv", feature = "fast"), allow(dead_code, unreachable_pub))]
mod parts;
mod pow;
mod scalar;
#[doc(hidden)]
pub mod soft;
#[cfg_attr(all(target_arch = "spirv", feature = "fast"), allow(dead_code, unreachable_pub))]
mod trigonometric;

pub use atan2::atan2;
pub use cbrt::cbrt;
pub use exponential::{expm1, sinh};
pub use floor::floor;
pub use logarithm::{asinh, ln_1p};
pub use pow::pow;
#[doc(hidden)]
pub use scalar::Scalar;
pub use trigonometric::{acos, asin};

// What the `fast` flavour has instructions for. An undecorated module lets the driver cancel `(x + c) - c`, so rounding
// to an integer has two forms as well.
#[cfg(all(target_arch = "spirv", feature = "fast"))]
use intrinsic::round;
#[cfg(all(target_arch = "spirv", feature = "fast"))]
pub use intrinsic::{exp, exp2, ln, log2, sin_cos};
#[cfg(not(all(target_arch = "spirv", feature = "fast")))]
use parts::round;
#[cfg(not(all(target_arch = "spirv", feature = "fast")))]
pub use {
    exponential::{exp, exp2},
    logarithm::{ln, log2},
    trigonometric::sin_cos,
};

// exact: hardware on the host, `soft` on the device; `fast`: the device's own instructions

#[cfg(all(not(target_arch = "spirv"), feature = "std"))]
mod hardware;
#[cfg(all(target_arch = "spirv", feature = "fast"))]
mod intrinsic;

#[cfg(all(not(target_arch = "spirv"), feature = "std"))]
use hardware as form;
#[cfg(all(target_arch = "spirv", feature = "fast"))]
use intrinsic as form;
#[cfg(not(any(all(not(target_arch = "spirv"), feature = "std"), all(target_arch = "spirv", feature = "fast"))))]
use soft as form;

/// Below this argument [`exp`] is zero: its result would not be a normal number.
pub const EXP_MIN: f32 = -87.33;
/// Above this argument [`exp`] is infinite.
pub const EXP_MAX: f32 = 88.722_83;
/// Below this argument [`exp2`] is zero.
pub const EXP2_MIN: f32 = -126.0;
/// Above this argument, the largest number below 128, [`exp2`] is infinite.
pub const EXP2_MAX: f32 = 127.999_99;
/// Beyond this magnitude [`sinh`] is infinite.
pub const SINH_MAX: f32 = 89.415_985;
/// [`sin_cos`] is defined for magnitudes up to this many turns.
pub const TURNS_MAX: f32 = 1_048_576.0;

/// The ratio of a circle's circumference to its diameter.
pub const PI: f32 = core::f32::consts::PI;
/// 1 / pi.
pub const INV_PI: f32 = core::f32::consts::FRAC_1_PI;
/// Half the distance from 1 to the next larger number: the relative error of one rounding.
pub const UNIT_ROUNDOFF: f32 = 1.0 / 16_777_216.0;
/// The smallest normal number; anything smaller in magnitude counts as zero.
pub const MIN_POSITIVE: f32 = f32::MIN_POSITIVE;

/// `a / b`, correctly rounded.
#[inline(always)]
pub fn div(a: f32, b: f32) -> f32 {
    form::div(a, b)
}

/// `1 / x`, correctly rounded.
#[inline(always)]
pub fn recip(x: f32) -> f32 {
    form::recip(x)
}

/// The square root of `x`, correctly rounded; NaN for `x < 0`.
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    form::sqrt(x)
}

/// `1 / sqrt(x)`, correctly rounded; infinity for a zero of either sign, NaN for `x < 0`.
#[inline(always)]
pub fn rsqrt(x: f32) -> f32 {
    form::rsqrt(x)
}

/// The magnitude below which [`flush`] gives zero: 2^-100.
pub const FLUSH_BELOW: f32 = 7.888_609e-31;

/// The smaller of two numbers; `b` if they are not ordered.
#[inline(always)]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger of two numbers; `b` if they are not ordered.
#[inline(always)]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `x` limited to `[lo, hi]`; `lo` for a NaN.
#[inline(always)]
pub fn clamp(x: f32, lo: f32, hi: f32) -> f32 {
    min(max(x, lo), hi)
}

/// The magnitude of `x`.
#[inline(always)]
pub fn abs(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & 0x7fff_ffff)
}

/// `x`, or zero if its magnitude is below 2^-100: what techniques apply at named points, so that a device that
/// flushes subnormal numbers gives the same bits.
#[inline(always)]
pub fn flush(x: f32) -> f32 {
    if abs(x) < FLUSH_BELOW { 0.0 } else { x }
}

/// The integer nearest to `x`, ties to even, for |x| < 2^22.
#[inline(always)]
pub fn nearest(x: f32) -> i32 {
    parts::nearest(x)
}

/// The product of two 32-bit integers as (high, low) words.
#[doc(hidden)]
#[inline(always)]
pub fn mul_wide(a: u32, b: u32) -> (u32, u32) {
    let (ah, al) = (a >> 16, a & 0xffff);
    let (bh, bl) = (b >> 16, b & 0xffff);
    let low = al.wrapping_mul(bl);
    let mid = ah.wrapping_mul(bl).wrapping_add(low >> 16);
    let cross = al.wrapping_mul(bh).wrapping_add(mid & 0xffff);
    let high = ah.wrapping_mul(bh).wrapping_add(mid >> 16).wrapping_add(cross >> 16);
    (high, (cross << 16) | (low & 0xffff))
}
