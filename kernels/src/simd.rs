//! What the processor offers for lanes, found when the program runs.

use restir_shared::lanes::{LaneKernel, SimdToken};

/// Instructions that a processor has for lanes. Every level gives the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimdLevel {
    /// Whatever the compiler makes of arrays for the target.
    Portable,
    /// AVX2: 256-bit registers, and the operations on bits that came with them.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512 with its extensions F, BW, DQ and VL: registers of twice the length, twice as many, and masks.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl SimdLevel {
    /// The levels that this processor has, best last.
    pub fn available() -> Vec<Self> {
        let levels = [
            (Self::Portable, true),
            #[cfg(target_arch = "x86_64")]
            (Self::Avx2, has_avx2()),
            #[cfg(target_arch = "x86_64")]
            (Self::Avx512, has_avx512()),
        ];
        levels.into_iter().filter(|(_, is_there)| *is_there).map(|(level, _)| level).collect()
    }
}

/// The registers of AVX-512, which the processor has.
#[derive(Clone, Copy, Debug)]
pub struct Avx512(());

impl Avx512 {
    /// A proof that the processor has them, if it has.
    pub fn detect() -> Option<Self> {
        has_avx512().then_some(Self(()))
    }
}

impl SimdToken for Avx512 {
    #[inline(always)]
    fn run<K: LaneKernel>(self, kernel: &K, input: &K::In, output: &mut K::Out) {
        #[cfg_attr(
            target_arch = "x86_64",
            target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")
        )]
        #[inline(never)]
        fn compiled<K: LaneKernel>(kernel: &K, input: &K::In, output: &mut K::Out) {
            kernel.run(input, output);
        }
        // SAFETY: there is a value only where the processor has what the function is compiled for
        #[allow(unused_unsafe, reason = "safe where there is no AVX-512")]
        unsafe {
            compiled(kernel, input, output);
        }
    }
}

/// Whether the processor has AVX2 and the operations on bits that came with it.
#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    let bits = is_x86_feature_detected!("bmi1") && is_x86_feature_detected!("bmi2");
    let counts = is_x86_feature_detected!("lzcnt") && is_x86_feature_detected!("popcnt");
    is_x86_feature_detected!("avx2") && bits && counts
}

/// Whether it has AVX-512, too.
fn has_avx512() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        let wide = is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw");
        let any_length = is_x86_feature_detected!("avx512dq") && is_x86_feature_detected!("avx512vl");
        has_avx2() && wide && any_length
    }
    #[cfg(not(target_arch = "x86_64"))]
    false
}
