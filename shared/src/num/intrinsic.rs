//! Device forms of the `fast` flavour: native division and the intrinsics that rust-gpu puts in place of a
//! crate named `libm`.

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
    libm::sqrtf(x)
}

#[inline(always)]
pub(super) fn rsqrt(x: f32) -> f32 {
    1.0 / libm::sqrtf(x)
}

/// `x` rounded to an integer for |x| < 2^22, ties upward: the integer as a number and as an `i32`.
#[inline(always)]
pub(super) fn round(x: f32) -> (f32, i32) {
    let n = libm::floorf(x + 0.5);
    (n, super::parts::nearest(n))
}

/// e^x.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// 2^x.
#[inline(always)]
pub fn exp2(x: f32) -> f32 {
    libm::exp2f(x)
}

/// The logarithm to base 2.
#[inline(always)]
pub fn log2(x: f32) -> f32 {
    libm::log2f(x)
}

/// The natural logarithm.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    libm::logf(x)
}

/// (sin, cos) of an angle in turns.
#[inline(always)]
pub fn sin_cos(u: f32) -> (f32, f32) {
    let turn = u - libm::floorf(u + 0.5);
    let x = turn * core::f32::consts::TAU;
    (libm::sinf(x), libm::cosf(x))
}
