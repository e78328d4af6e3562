//! Registers for which what runs in step is compiled.

use restir_shared::lanes::{Registers, Stage};

/// The registers of AVX-512, which the processor has.
#[derive(Clone, Copy, Debug)]
pub struct Avx512(());

impl Avx512 {
    /// A proof that the processor has them, if it has.
    pub fn detect() -> Option<Self> {
        has_avx512().then_some(Self(()))
    }
}

impl Registers for Avx512 {
    #[inline(always)]
    fn run<S: Stage>(self, stage: &S, from: &S::From, to: &mut S::To) {
        #[cfg_attr(
            target_arch = "x86_64",
            target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")
        )]
        #[inline(never)]
        fn compiled<S: Stage>(stage: &S, from: &S::From, to: &mut S::To) {
            stage.run(from, to);
        }
        // SAFETY: there is a value only where the processor has what the function is compiled for
        #[allow(unused_unsafe, reason = "safe where there is no AVX-512")]
        unsafe {
            compiled(stage, from, to);
        }
    }
}

/// Whether the processor has AVX2, AVX-512 with its extensions F, BW, DQ and VL, and the operations on bits that came with them.
pub fn has_avx512() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        let wide = is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw");
        let any_length = is_x86_feature_detected!("avx512dq") && is_x86_feature_detected!("avx512vl");
        let bits = is_x86_feature_detected!("bmi1") && is_x86_feature_detected!("bmi2");
        let counts = is_x86_feature_detected!("lzcnt") && is_x86_feature_detected!("popcnt");
        is_x86_feature_detected!("avx2") && wide && any_length && bits && counts
    }
    #[cfg(not(target_arch = "x86_64"))]
    false
}
