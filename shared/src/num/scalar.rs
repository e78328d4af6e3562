//! What resampling asks of a number, so that its formulas run in `f32` on a device and in wider types in tests.

use core::ops::{Add, Mul, Sub};

/// A real number.
pub trait Scalar: Copy + PartialOrd + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// The largest number below 1. Times a normal number it is the next one below that.
    const BELOW_ONE: Self;

    /// This number divided by another, correctly rounded.
    fn over(self, divisor: Self) -> Self;

    /// A weight in the range in which kernels keep them: at most 2^100, zero below 2^-100 and for what is no number.
    fn within_range(self) -> Self;
}

/// The largest weight: 2^100.
const LARGEST: f32 = 1.267_650_6e30;

impl Scalar for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const BELOW_ONE: Self = 1.0 - super::UNIT_ROUNDOFF;

    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        super::div(self, divisor)
    }

    #[inline(always)]
    fn within_range(self) -> Self {
        if self >= super::FLUSH_BELOW { super::min(self, LARGEST) } else { Self::ZERO }
    }
}

#[cfg(not(target_arch = "spirv"))]
impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const BELOW_ONE: Self = 1.0 - f64::EPSILON / 2.0;

    fn over(self, divisor: Self) -> Self {
        self / divisor
    }

    fn within_range(self) -> Self {
        if self > 0.0 { self } else { 0.0 }
    }
}
