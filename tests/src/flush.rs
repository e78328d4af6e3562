//! Running code as on a device that flushes subnormal numbers.

/// Runs `work` with this thread's subnormal operands and results flushed to zero, as far as the processor can:
/// `None` elsewhere than on x86-64. Only this thread is changed.
pub fn with_flush_to_zero<T>(work: impl FnOnce() -> T) -> Option<T> {
    #[cfg(target_arch = "x86_64")]
    {
        let _restored = mode::Flushing::enter();
        Some(work())
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        let _ = work;
        None
    }
}

#[cfg(target_arch = "x86_64")]
mod mode {
    use std::arch::asm;

    /// Flush-to-zero and denormals-are-zero.
    const FLUSH: u32 = 1 << 15 | 1 << 6;

    /// The mode, until it is dropped.
    pub(super) struct Flushing {
        before: u32,
    }

    impl Flushing {
        pub(super) fn enter() -> Self {
            Self { before: exchange(|mode| mode | FLUSH) }
        }
    }

    impl Drop for Flushing {
        fn drop(&mut self) {
            exchange(|_| self.before);
        }
    }

    /// Replaces the control word of this thread's vector unit and gives the old one.
    fn exchange(change: impl FnOnce(u32) -> u32) -> u32 {
        let mut mode = 0_u32;
        // SAFETY: reads and writes the control word through valid addresses; the new one differs from the old in two
        // bits that mask nothing. As assembly with a memory clobber it stays in order with calls that are not inlined.
        unsafe {
            asm!("stmxcsr [{}]", in(reg) &raw mut mode, options(nostack));
            let changed = change(mode);
            asm!("ldmxcsr [{}]", in(reg) &raw const changed, options(nostack));
        }
        mode
    }
}
