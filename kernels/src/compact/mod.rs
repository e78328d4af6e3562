//! Compaction, see [`restir_shared::compact`].

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
