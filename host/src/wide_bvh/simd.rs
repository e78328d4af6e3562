//! Eight floats at a time: AVX2 where the processor has it, and a portable form that gives the same bits.
//!
//! Both consist of the operations that IEEE 754 fixes, one rounding each. There is no fused multiplication, which would
//! round differently.

use std::array::from_fn;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// How many lanes there are.
pub(super) const LANES: usize = 8;

/// A row of memory for [`Lanes`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Row(pub [f32; LANES]);

/// Eight floats, or eight conditions: lanes of all ones or all zeros.
pub(super) trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
{
    fn load(row: &Row) -> Self;
    fn store(self) -> Row;
    fn splat(x: f32) -> Self;
    /// As [`restir_shared::num::min`]: `other` if the two are equal or not ordered.
    fn min(self, other: Self) -> Self;
    /// As [`restir_shared::num::max`]: `other` if the two are equal or not ordered.
    fn max(self, other: Self) -> Self;
    /// `self < other`.
    fn lt(self, other: Self) -> Self;
    /// `self <= other`.
    fn le(self, other: Self) -> Self;
    /// `self` where `mask` does not hold, else zero.
    fn unless(self, mask: Self) -> Self;
    /// A condition as bits, lane 0 lowest.
    fn bits(self) -> u32;
}

/// Arrays, which compilers turn into whatever vectors the target has.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(super) struct Portable([f32; LANES]);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(from_fn(|i| f(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn zip_bits(self, other: Self, f: impl Fn(u32, u32) -> u32) -> Self {
        self.zip(other, |a, b| f32::from_bits(f(a.to_bits(), b.to_bits())))
    }

    #[inline(always)]
    fn compare(self, other: Self, f: impl Fn(f32, f32) -> bool) -> Self {
        self.zip(other, |a, b| f32::from_bits(if f(a, b) { u32::MAX } else { 0 }))
    }
}

macro_rules! portable {
    ($($trait:ident, $method:ident: $combine:ident, $f:expr;)*) => {
        $(impl $trait for Portable {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.$combine(other, $f)
            }
        })*
    };
}

portable! {
    Add, add: zip, |a, b| a + b;
    Sub, sub: zip, |a, b| a - b;
    Mul, mul: zip, |a, b| a * b;
    Div, div: zip, |a, b| a / b;
    BitAnd, bitand: zip_bits, |a, b| a & b;
    BitOr, bitor: zip_bits, |a, b| a | b;
}

impl Lanes for Portable {
    #[inline(always)]
    fn load(row: &Row) -> Self {
        Self(row.0)
    }

    #[inline(always)]
    fn store(self) -> Row {
        Row(self.0)
    }

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; LANES])
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn lt(self, other: Self) -> Self {
        self.compare(other, |a, b| a < b)
    }

    #[inline(always)]
    fn le(self, other: Self) -> Self {
        self.compare(other, |a, b| a <= b)
    }

    #[inline(always)]
    fn unless(self, mask: Self) -> Self {
        self.zip_bits(mask, |x, m| x & !m)
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        (0..LANES).fold(0, |bits, i| bits | (self.0[i].to_bits() >> 31) << i)
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use avx2::Avx2;

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{Add, BitAnd, BitOr, Div, LANES, Lanes, Mul, Row, Sub};
    use std::arch::x86_64::*;

    /// A 256-bit register.
    ///
    /// # Safety
    /// Whoever names this type has to be inlined into a function with the target feature `avx2`, and to have checked
    /// that the processor has it: all of its operations rely on that. Loads and stores are of whole aligned [`Row`]s.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx2(__m256);

    macro_rules! operators {
        ($($trait:ident, $method:ident: $intrinsic:ident;)*) => {
            $(impl $trait for Avx2 {
                type Output = Self;

                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    // SAFETY: see the type
                    Self(unsafe { $intrinsic(self.0, other.0) })
                }
            })*
        };
    }

    operators! {
        Add, add: _mm256_add_ps;
        Sub, sub: _mm256_sub_ps;
        Mul, mul: _mm256_mul_ps;
        Div, div: _mm256_div_ps;
        BitAnd, bitand: _mm256_and_ps;
        BitOr, bitor: _mm256_or_ps;
    }

    const _: () = assert!(size_of::<__m256>() == LANES * 4 && align_of::<Row>() == 32);

    impl Lanes for Avx2 {
        #[inline(always)]
        fn load(row: &Row) -> Self {
            // SAFETY: see the type
            Self(unsafe { _mm256_load_ps(row.0.as_ptr()) })
        }

        #[inline(always)]
        fn store(self) -> Row {
            let mut row = Row([0.0; LANES]);
            // SAFETY: see the type
            unsafe { _mm256_store_ps(row.0.as_mut_ptr(), self.0) };
            row
        }

        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: see the type
            Self(unsafe { _mm256_set1_ps(x) })
        }

        #[inline(always)]
        fn min(self, other: Self) -> Self {
            // SAFETY: see the type
            Self(unsafe { _mm256_min_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn max(self, other: Self) -> Self {
            // SAFETY: see the type
            Self(unsafe { _mm256_max_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn lt(self, other: Self) -> Self {
            // SAFETY: see the type
            Self(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) })
        }

        #[inline(always)]
        fn le(self, other: Self) -> Self {
            // SAFETY: see the type
            Self(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) })
        }

        #[inline(always)]
        fn unless(self, mask: Self) -> Self {
            // SAFETY: see the type
            Self(unsafe { _mm256_andnot_ps(mask.0, self.0) })
        }

        #[inline(always)]
        fn bits(self) -> u32 {
            // SAFETY: see the type
            unsafe { _mm256_movemask_ps(self.0) as u32 }
        }
    }
}
