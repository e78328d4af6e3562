//! First pass of a compaction.

use restir_shared::compact::{self, CompactParams};

kernel! {
    /// How many items of block x are in bucket y.
    pub fn compact_count(64, 1) {
        constants {}
        params 0: CompactParams,
        read { 1: words: u32 },
        own { 2: counts: u32 },
    }
    |x, y, at, p| counts[at] = compact::count(&p, words, x, y)
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    // items, buckets, first, shift, mask
    [(1_u32, 1, 1, 0, u32::MAX), (1000, 1, 1, 0, 1), (4096, 5, 2, 0, 7), (777, 16, 0, 4, 15)]
        .map(|(items, buckets, first, shift, mask)| {
            let blocks = items.div_ceil(compact::BLOCK);
            let params = CompactParams { width: blocks, height: buckets, items, blocks, buckets, first, shift, mask };
            crate::Case::new(&DESC, format!("{items} items, {buckets} buckets"), blocks, buckets)
                .with(&[params])
                .with(&crate::case::random_words(items, 1))
                .output()
        })
        .into()
}
