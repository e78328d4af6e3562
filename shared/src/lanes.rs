//! What the host computes by SIMD: loops over as many lanes as a register has, which a compiler turns into one pass over registers.
//!
//! The body of such a loop is the code that devices run, for one lane, so that there is one form of it and one set of bits. What keeps a
//! compiler from vectorising it are loops within, calls that are not inlined (closures often are not), and branches that end in a panic; it
//! then runs lane by lane.
//!
//! ```
//! use restir_shared::glam::Vec3;
//! use restir_shared::lanes::{LANES, Lanes, SimdToken, LaneKernel};
//! use restir_shared::vec::length;
//!
//! /// The lengths of vectors.
//! struct Lengths;
//!
//! impl LaneKernel for Lengths {
//!     type In = Lanes<Vec3>;
//!     type Out = Lanes<f32>;
//!
//!     fn run(&self, vectors: &Lanes<Vec3>, lengths: &mut Lanes<f32>) {
//!         for lane in 0..LANES {
//!             lengths.set(lane, length(vectors.get(lane)));
//!         }
//!     }
//! }
//!
//! /// The instructions that every processor has. For others, the function that runs the kernel has target features.
//! #[derive(Clone, Copy)]
//! struct Any;
//!
//! impl SimdToken for Any {
//!     const GATHERS: bool = false;
//!
//!     fn run<K: LaneKernel>(self, kernel: &K, input: &K::In, output: &mut K::Out) {
//!         kernel.run(input, output);
//!     }
//! }
//!
//! let (mut vectors, mut lengths) = (Lanes::ZERO, Lanes::ZERO);
//! vectors.set(3, Vec3::new(3.0, 4.0, 0.0));
//! Any.run(&Lengths, &vectors, &mut lengths);
//! assert_eq!([lengths.get(2), lengths.get(3)], [0.0, 5.0]);
//! ```

use core::fmt::Debug;
use glam::{Vec2, Vec3};

/// The number of lanes: numbers of 32 bits in a register of 512.
pub const LANES: usize = 16;

/// A function from lanes to lanes.
pub trait LaneKernel {
    /// What it reads.
    type In;
    /// What it writes.
    type Out;

    /// A loop over lanes; has to be inlined, with all that it calls. What it writes is not what it reads: a compiler gives up before it
    /// has proved of each of a hundred accesses to the same thing that it leaves the scene alone.
    fn run(&self, input: &Self::In, output: &mut Self::Out);
}

/// Instructions for which kernels over lanes are compiled. A value of the type proves that the processor has them.
pub trait SimdToken: Copy {
    /// Whether compilers load from many addresses at once by these instructions. Where they do not, a kernel that reads tables runs lane by
    /// lane, and what it computes beside should be a kernel of its own.
    const GATHERS: bool;

    /// Runs a kernel in a function of its own, compiled for these instructions.
    fn run<K: LaneKernel>(self, kernel: &K, input: &K::In, output: &mut K::Out);
}

/// What lanes may hold, as a structure of arrays.
pub trait Soa: Copy {
    /// A value in each lane, by components.
    type Lanes: Copy + Debug;
    /// Zeros, which are a value of every type that counts.
    const ZERO: Self::Lanes;

    /// The value of a lane.
    fn get(lanes: &Self::Lanes, lane: usize) -> Self;

    /// Replaces the value of a lane.
    fn set(self, lanes: &mut Self::Lanes, lane: usize);
}

/// A value in each lane.
#[derive(Clone, Copy, Debug)]
pub struct Lanes<T: Soa>(T::Lanes);

impl<T: Soa> Lanes<T> {
    /// Zeros.
    pub const ZERO: Self = Self(T::ZERO);

    /// The same value in all lanes.
    #[inline(always)]
    pub fn all(value: T) -> Self {
        Self::from_fn(|_| value)
    }

    /// In each lane what `value` gives for it.
    #[inline(always)]
    pub fn from_fn(mut value: impl FnMut(usize) -> T) -> Self {
        let mut lanes = Self::ZERO;
        for lane in 0..LANES {
            lanes.set(lane, value(lane));
        }
        lanes
    }

    /// The value of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> T {
        T::get(&self.0, lane)
    }

    /// Replaces the value of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, value: T) {
        value.set(&mut self.0, lane);
    }
}

impl Lanes<bool> {
    /// The lanes in which it holds, as bits, lane 0 lowest.
    #[inline(always)]
    pub fn bits(&self) -> u32 {
        let mut bits = 0;
        for lane in 0..LANES {
            bits |= u32::from(self.get(lane)) << lane;
        }
        bits
    }
}

/// The lanes of which `bits` has the bits, lowest first.
#[inline(always)]
pub(crate) fn lanes_of(mut bits: u32) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let lane = (bits != 0).then_some(bits.trailing_zeros() as usize % LANES);
        bits &= bits.wrapping_sub(1);
        lane
    })
}

/// Makes lanes of a type that has one number.
macro_rules! numbers {
    ($($number:ty = $zero:expr),*) => {
        $(impl $crate::lanes::Soa for $number {
            type Lanes = [Self; $crate::lanes::LANES];
            const ZERO: Self::Lanes = [$zero; $crate::lanes::LANES];

            #[inline(always)]
            fn get(lanes: &Self::Lanes, lane: usize) -> Self {
                lanes[lane]
            }

            #[inline(always)]
            fn set(self, lanes: &mut Self::Lanes, lane: usize) {
                lanes[lane] = self;
            }
        })*
    };
}

/// Makes lanes of a type by its fields.
macro_rules! soa {
    ($($all:ident = $one:ty { $($field:ident: $of:ty),* })*) => {
        $(
            #[doc = concat!("A `", stringify!($one), "` in each lane.")]
            #[doc(hidden)]
            #[derive(Clone, Copy, Debug)]
            #[allow(unreachable_pub, reason = "as the trait asks, also of what is private")]
            pub struct $all {
                $($field: <$of as $crate::lanes::Soa>::Lanes),*
            }

            impl $crate::lanes::Soa for $one {
                type Lanes = $all;
                const ZERO: $all = $all { $($field: <$of as $crate::lanes::Soa>::ZERO),* };

                #[inline(always)]
                fn get(lanes: &$all, lane: usize) -> Self {
                    Self { $($field: <$of as $crate::lanes::Soa>::get(&lanes.$field, lane)),* }
                }

                #[inline(always)]
                fn set(self, lanes: &mut $all, lane: usize) {
                    $($crate::lanes::Soa::set(self.$field, &mut lanes.$field, lane);)*
                }
            }
        )*
    };
}

pub(crate) use {numbers, soa};

numbers! { f32 = 0.0, u32 = 0 }

/// In words, as the numbers beside them are: compilers load and store these under a mask, which of bytes AVX2 cannot.
impl Soa for bool {
    type Lanes = [u32; LANES];
    const ZERO: Self::Lanes = [0; LANES];

    #[inline(always)]
    fn get(lanes: &Self::Lanes, lane: usize) -> Self {
        lanes[lane] != 0
    }

    #[inline(always)]
    fn set(self, lanes: &mut Self::Lanes, lane: usize) {
        lanes[lane] = u32::from(self);
    }
}

soa! {
    Vec2s = Vec2 { x: f32, y: f32 }
    Vec3s = Vec3 { x: f32, y: f32, z: f32 }
}
