//! The memory of a traversal's ring: natively an array, on a device words of the workgroup.
//!
//! An invocation reads only slots that it has written before in the same traversal, and no slot of another one. So neither what the memory held
//! before nor the order in which invocations run changes a bit.

#[cfg(target_arch = "spirv")]
use super::workgroup;

/// Slots.
pub(super) const SLOTS: u32 = 8;

/// Where a traversal has its ring.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scratch {
    /// What the slots hold before: nothing may depend on it.
    #[cfg(not(target_arch = "spirv"))]
    pub before: u32,
    /// The invocation's number in its workgroup, below [`Self::INVOCATIONS`].
    #[cfg(target_arch = "spirv")]
    pub invocation: u32,
}

impl Scratch {
    /// The most invocations that a workgroup may have in which rays are traced.
    pub const INVOCATIONS: u32 = 64;
}

/// The slots of one traversal.
#[cfg(not(target_arch = "spirv"))]
pub(super) struct Ring([u32; SLOTS as usize]);

#[cfg(not(target_arch = "spirv"))]
impl Ring {
    #[inline(always)]
    pub(super) fn new(scratch: Scratch) -> Self {
        Self([scratch.before; SLOTS as usize])
    }

    /// Writes a word where `at` falls in the ring; what stood there.
    #[inline(always)]
    pub(super) fn exchange(&mut self, at: u32, word: u32) -> u32 {
        core::mem::replace(&mut self.0[(at % SLOTS) as usize], word)
    }
}

/// The slots of one traversal.
#[cfg(target_arch = "spirv")]
pub(super) struct Ring(Scratch);

#[cfg(target_arch = "spirv")]
impl Ring {
    #[inline(always)]
    pub(super) fn new(scratch: Scratch) -> Self {
        Self(scratch)
    }

    /// Writes a word where `at` falls in the ring; what stood there.
    #[inline(always)]
    pub(super) fn exchange(&mut self, at: u32, word: u32) -> u32 {
        const WORDS: usize = (SLOTS * Scratch::INVOCATIONS) as usize;
        workgroup::access::<WORDS>(self.0.invocation, at % SLOTS, word, true)
    }
}
