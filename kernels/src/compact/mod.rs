//! Compaction, see [`restir_shared::compact`].

kernels! {
    compact_count,
    compact_gather,
    compact_scan,
    compact_sum,
}
