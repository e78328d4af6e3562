//! Eight floats at a time: AVX2 where the processor has it, and a portable form that gives the same bits.
//!
//! Both consist of the operations that IEEE 754 fixes, one rounding each. There is no fused multiplication, which would
//! round differently.

use glam::Vec3;
use std::array::from_fn;
use std::mem::MaybeUninit;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// How many lanes there are.
pub(super) const WIDTH: usize = 8;

/// A row of memory for [`F32x8`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Array8(pub [f32; WIDTH]);

/// Eight floats, or eight conditions: lanes of all ones or all zeros.
pub(super) trait F32x8:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
{
    fn load(row: &Array8) -> Self;
    fn store(self) -> Array8;
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
    /// Writes the words of the given lanes one after the other, that of the highest lane first. What comes after them in `to` is
    /// not specified.
    fn compress(words: &[u32; WIDTH], lanes: u32, to: &mut [MaybeUninit<u32>; WIDTH]);
}

#[inline(always)]
pub(super) fn splat<L: F32x8>(v: Vec3) -> [L; 3] {
    [L::splat(v.x), L::splat(v.y), L::splat(v.z)]
}

/// The lowest lane of `lanes`, of which there are any.
#[inline(always)]
pub(super) fn lowest(lanes: u32) -> usize {
    // `&` shows the compiler that it is a lane
    lanes.trailing_zeros() as usize & (WIDTH - 1)
}

/// Takes the lowest lane out of `lanes`, of which there are any.
#[inline(always)]
pub(super) fn take_lowest(lanes: &mut u32) -> usize {
    let lane = lowest(*lanes);
    *lanes &= lanes.wrapping_sub(1);
    lane
}

/// Implements the operations of two operands, each as one expression, and [`F32x8`] with the other ones.
macro_rules! lanes {
    (
        $type:ident, |$a:ident, $b:ident|
        { $($trait:ident::$operator:ident => $operation:expr;)* }
        { $($method:ident => $result:expr;)* }
        $($others:tt)*
    ) => {
        $(impl $trait for $type {
            type Output = Self;

            #[inline(always)]
            fn $operator(self, other: Self) -> Self {
                let ($a, $b) = (self, other);
                $operation
            }
        })*

        impl F32x8 for $type {
            $(#[inline(always)]
            fn $method(self, other: Self) -> Self {
                let ($a, $b) = (self, other);
                $result
            })*

            $($others)*
        }
    };
}

/// Arrays, which compilers turn into whatever vectors the target has.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(super) struct Portable([f32; WIDTH]);

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
    fn compare(self, other: Self, f: impl Fn(&f32, &f32) -> bool) -> Self {
        self.zip(other, |a, b| f32::from_bits(if f(&a, &b) { u32::MAX } else { 0 }))
    }
}

lanes! {
    Portable, |a, b|
    {
        Add::add => a.zip(b, Add::add);
        Sub::sub => a.zip(b, Sub::sub);
        Mul::mul => a.zip(b, Mul::mul);
        Div::div => a.zip(b, Div::div);
        BitAnd::bitand => a.zip_bits(b, BitAnd::bitand);
        BitOr::bitor => a.zip_bits(b, BitOr::bitor);
    }
    {
        min => a.zip(b, |a, b| if a < b { a } else { b });
        max => a.zip(b, |a, b| if a > b { a } else { b });
        lt => a.compare(b, f32::lt);
        le => a.compare(b, f32::le);
        unless => a.zip_bits(b, |x, mask| x & !mask);
    }

    #[inline(always)]
    fn load(row: &Array8) -> Self {
        Self(row.0)
    }

    #[inline(always)]
    fn store(self) -> Array8 {
        Array8(self.0)
    }

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; WIDTH])
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        (0..WIDTH).fold(0, |bits, i| bits | (self.0[i].to_bits() >> 31) << i)
    }

    #[inline(always)]
    fn compress(words: &[u32; WIDTH], lanes: u32, to: &mut [MaybeUninit<u32>; WIDTH]) {
        let taken = (0..WIDTH).rev().filter(|lane| lanes >> lane & 1 != 0);
        to.iter_mut().zip(taken).for_each(|(to, lane)| _ = to.write(words[lane]));
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use avx2::Avx2;

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{Add, Array8, BitAnd, BitOr, Div, F32x8, MaybeUninit, Mul, Sub, WIDTH};
    use std::arch::x86_64::*;

    /// A 256-bit register.
    ///
    /// # Safety
    /// Whoever names this type has to be inlined into a function with the target feature `avx2`, and to have checked
    /// that the processor has it: all of its operations rely on that. Loads and stores are of whole
    /// arrays of eight, aligned where they are a [`Array8`].
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx2(__m256);

    const _: () = assert!(size_of::<__m256>() == WIDTH * 4 && align_of::<Array8>() == 32);

    // SAFETY: of all that is unsafe here, see the type
    lanes! {
        Avx2, |a, b|
        {
            Add::add => Self(unsafe { _mm256_add_ps(a.0, b.0) });
            Sub::sub => Self(unsafe { _mm256_sub_ps(a.0, b.0) });
            Mul::mul => Self(unsafe { _mm256_mul_ps(a.0, b.0) });
            Div::div => Self(unsafe { _mm256_div_ps(a.0, b.0) });
            BitAnd::bitand => Self(unsafe { _mm256_and_ps(a.0, b.0) });
            BitOr::bitor => Self(unsafe { _mm256_or_ps(a.0, b.0) });
        }
        {
            min => Self(unsafe { _mm256_min_ps(a.0, b.0) });
            max => Self(unsafe { _mm256_max_ps(a.0, b.0) });
            lt => Self(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(a.0, b.0) });
            le => Self(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(a.0, b.0) });
            unless => Self(unsafe { _mm256_andnot_ps(b.0, a.0) });
        }

        #[inline(always)]
        fn load(row: &Array8) -> Self {
            Self(unsafe { _mm256_load_ps(row.0.as_ptr()) })
        }

        #[inline(always)]
        fn store(self) -> Array8 {
            let mut row = Array8([0.0; WIDTH]);
            unsafe { _mm256_store_ps(row.0.as_mut_ptr(), self.0) };
            row
        }

        #[inline(always)]
        fn splat(x: f32) -> Self {
            Self(unsafe { _mm256_set1_ps(x) })
        }

        #[inline(always)]
        fn bits(self) -> u32 {
            unsafe { _mm256_movemask_ps(self.0) as u32 }
        }

        #[inline(always)]
        fn compress(words: &[u32; WIDTH], lanes: u32, to: &mut [MaybeUninit<u32>; WIDTH]) {
            let order = &COMPRESSED[lanes as usize & (COMPRESSED.len() - 1)];
            unsafe {
                let order = _mm256_cvtepu8_epi32(_mm_loadl_epi64(order.as_ptr().cast()));
                let words = _mm256_loadu_si256(words.as_ptr().cast());
                _mm256_storeu_si256(to.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(words, order));
            }
        }
    }

    /// For each set of lanes its members, the highest first, and then zeros.
    static COMPRESSED: [[u8; WIDTH]; 1 << WIDTH] = {
        let mut table = [[0; WIDTH]; 1 << WIDTH];
        let mut lanes = 0;
        while lanes < table.len() {
            let (mut rest, mut at) = (lanes, 0);
            while rest != 0 {
                let highest = rest.ilog2();
                table[lanes][at] = highest as u8;
                rest ^= 1 << highest;
                at += 1;
            }
            lanes += 1;
        }
        table
    };
}
