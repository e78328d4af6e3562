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
