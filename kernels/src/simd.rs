//! What the processor offers for lanes, found when the program runs.

use restir_shared::lanes::{LaneKernel, SimdToken};

/// Instructions that a processor has for lanes; a greater level has those of all below. Every level gives the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// Whatever the compiler makes of arrays for the target. Kernels go pixel by pixel: with registers of 128 bits lanes take longer.
    Portable,
    /// AVX2: 256-bit registers, and the operations on bits that came with them.
    Avx2,
    /// AVX-512 with its extensions F, BW, DQ and VL: registers of twice the length, twice as many, and masks.
    Avx512,
}

impl SimdLevel {
    /// The levels that this processor has, best last.
    pub fn available() -> Vec<Self> {
        [Self::Portable, Self::Avx2, Self::Avx512].into_iter().filter(|level| level.is_available()).collect()
    }

    /// The best level that this processor has.
    pub fn best() -> Self {
        Self::Avx512.or_below()
    }

    /// This level, or the best below it that this processor has.
    #[must_use]
    pub fn or_below(self) -> Self {
        let below = [Self::Avx512, Self::Avx2].into_iter().find(|&level| level <= self && level.is_available());
        below.unwrap_or(Self::Portable)
    }

    #[cfg(target_arch = "x86_64")]
    fn is_available(self) -> bool {
        let bits = is_x86_feature_detected!("bmi1") && is_x86_feature_detected!("bmi2");
        let counts = is_x86_feature_detected!("lzcnt") && is_x86_feature_detected!("popcnt");
        let avx2 = is_x86_feature_detected!("avx2") && bits && counts;
        let wide = is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw");
        let any_length = is_x86_feature_detected!("avx512dq") && is_x86_feature_detected!("avx512vl");
        match self {
            Self::Portable => true,
            Self::Avx2 => avx2,
            Self::Avx512 => avx2 && wide && any_length,
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn is_available(self) -> bool {
        self == Self::Portable
    }
}

/// Declares the proof that the processor has the instructions of a level, for which kernels over lanes are compiled.
macro_rules! token {
    ($(#[$doc:meta])* $token:ident, gathers: $gathers:literal, $features:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $token(());

        impl $token {
            /// A proof that the processor has them, if this is the level.
            pub fn at(level: SimdLevel) -> Option<Self> {
                (level == SimdLevel::$token && level.is_available()).then_some(Self(()))
            }
        }

        impl SimdToken for $token {
            const GATHERS: bool = $gathers;

            #[inline(always)]
            fn run<K: LaneKernel>(self, kernel: &K, input: &K::In, output: &mut K::Out) {
                #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
                #[inline(never)]
                fn compiled<K: LaneKernel>(kernel: &K, input: &K::In, output: &mut K::Out) {
                    kernel.run(input, output);
                }
                // SAFETY: there is a value only where the processor has what the function is compiled for
                #[allow(unused_unsafe, reason = "safe on processors that have no such level")]
                unsafe {
                    compiled(kernel, input, output);
                }
            }
        }
    };
}

token! {
    /// The registers of AVX2, which the processor has. It gathers, too, but on many processors no faster than one by one, and compilers
    /// that know none in particular do not use it.
    Avx2, gathers: false, "avx2,bmi1,bmi2,lzcnt,popcnt"
}
token! {
    /// The registers of AVX-512, which the processor has.
    Avx512, gathers: true, "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt"
}
