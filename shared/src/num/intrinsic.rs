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

/// e^x.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// The natural logarithm.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    libm::logf(x)
}

/// (sin, cos) of an angle in turns.
#[inline(always)]
pub fn sin_cos(u: f32) -> (f32, f32) {
    // no adding and subtracting of a large number: an undecorated module lets the driver cancel it
    let turn = u - libm::floorf(u + 0.5);
    let x = turn * core::f32::consts::TAU;
    (libm::sinf(x), libm::cosf(x))
}
