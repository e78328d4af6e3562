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
    compact_sum,
}

/// The parity cases of these kernels.
#[cfg(feature = "cases")]
pub(crate) fn cases() -> Vec<crate::Case> {
    [compact_count::cases(), compact_gather::cases(), compact_scan::cases(), compact_sum::cases()].concat()
}
