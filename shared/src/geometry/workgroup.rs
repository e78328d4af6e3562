//! Memory of the workgroup on a device.
//!
//! Entry points can be given such memory as an argument, but no structure can hold the reference, and so no scene.

use super::Scratch;

/// Reads a word of an invocation, and replaces it if `writes` says so; what stood there. `N` is the number of words of a workgroup, and names
/// the memory: each use has a number that no other has. `at` counts the invocation's own words.
///
/// Invocations next to each other have words next to each other. Each reads only words that it has written before, so that neither what the
/// memory held nor the order in which invocations run changes a bit.
#[inline(always)]
pub(crate) fn access<const N: usize>(invocation: u32, at: u32, word: u32, writes: bool) -> u32 {
    access_slot::<N>(at * Scratch::INVOCATIONS + invocation, word, writes)
}

fn access_slot<const N: usize>(slot: u32, word: u32, writes: bool) -> u32 {
    let words: *mut [u32; N];
    // SAFETY: a variable of the type that its name has here; invocations use different slots, as kernels have no larger workgroups
    unsafe {
        core::arch::asm!("{words} = OpVariable typeof{words} Workgroup", words = out(reg) words);
        let stood = (*words)[slot as usize];
        if writes {
            (*words)[slot as usize] = word;
        }
        stood
    }
}
