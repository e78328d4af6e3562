//! Numbers and where random ones come from.

use crate::num;
use core::ops::{Add, Mul};

/// What weights are: [`f32`], or exact numbers in tests.
pub trait Scalar: Copy + PartialOrd + Add<Output = Self> + Mul<Output = Self> {
    /// Nothing.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// The quotient; `other` is not zero.
    fn over(self, other: Self) -> Self;
}

impl Scalar for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    #[inline(always)]
    fn over(self, other: Self) -> Self {
        num::div(self, other)
    }
}

/// A stream of random numbers, and all choices that are made by it. [`sources!`](crate::sources) declares them.
pub trait Source {}

/// Random numbers of this source are independent of the other's.
pub trait Apart<Other>: Source {}

impl<A: Source, B: Source> Source for (A, B) {}

impl<A: Apart<Other>, B: Apart<Other>, Other> Apart<Other> for (A, B) {}

/// Declares sources of random numbers, each independent of all others of the list.
#[macro_export]
macro_rules! sources {
    () => {};
    ($first:ident $(, $rest:ident)* $(,)?) => {
        /// A source of random numbers.
        #[derive(Clone, Copy, Debug)]
        pub struct $first;
        impl $crate::conditional::Source for $first {}
        $(
            impl $crate::conditional::Apart<$rest> for $first {}
            impl $crate::conditional::Apart<$first> for $rest {}
        )*
        $crate::sources! { $($rest),* }
    };
}
