//! Rounding down.

/// The largest integer that is not above `x`, as a number; what is zero is positive.
#[cfg(target_arch = "spirv")]
#[inline(always)]
pub fn floor(x: f32) -> f32 {
    // an instruction that is exact on every device; the sum makes a positive zero of a negative one
    libm::floorf(x) + 0.0
}

/// The largest integer that is not above `x`, as a number; what is zero is positive.
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub fn floor(x: f32) -> f32 {
    /// From here on numbers are whole.
    const WHOLE: f32 = 8_388_608.0;
    let truncated = x as i32 as f32;
    let floor = if truncated > x { truncated - 1.0 } else { truncated };
    if super::abs(x) < WHOLE { floor } else { x }
}
