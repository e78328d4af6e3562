//! Rounding down.

/// The largest integer that is not above `x`, as a number; what is zero is positive.
#[cfg(target_arch = "spirv")]
#[inline(always)]
pub fn floor(x: f32) -> f32 {
    // an instruction that is exact on every device, but for the sign of zero
    let bits = libm::floorf(x).to_bits();
    f32::from_bits(if bits << 1 == 0 { 0 } else { bits })
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
