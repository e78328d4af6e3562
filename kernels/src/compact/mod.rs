//! Compaction, see [`restir_shared::compact`].
//!
//! ```
//! use restir_kernels::Access;
//! use restir_kernels::compact::{KERNELS, compact_count};
//!
//! // the first of the passes reads the items and writes a count for each block of them
//! assert_eq!(KERNELS[0].name, compact_count::DESC.name);
//! assert!(compact_count::DESC.bindings.iter().any(|binding| binding.access == Access::Own));
//! ```

kernels! {
    compact_count,
    compact_gather,
    compact_scan,
    compact_starts,
    compact_sum,
    compact_take,
}

/// The parity cases of these kernels.
#[cfg(feature = "cases")]
pub(crate) fn cases() -> Vec<crate::Case> {
    let of_compaction = [compact_count::cases(), compact_gather::cases(), compact_scan::cases(), compact_sum::cases()];
    [of_compaction.concat(), compact_starts::cases(), compact_take::cases()].concat()
}
