//! Offsets of a compaction, one level of them.

use restir_shared::compact::{self, ScanParams};

kernel! {
    /// The sum of all values before an element, by those of its block and the block's own offset.
    pub fn compact_scan(64, 1) {
        constants {}
        params 0: ScanParams,
        read { 1: values: u32, 2: parents: u32 },
        own { 3: offsets: u32 },
    }
    |x, y, at, p| offsets[at] = compact::scan(&p, values, parents, y * p.width + x)
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    // one more offset than values; the last invocations of the second case only fill the grid
    [(1_u32, [2, 1]), (1000, [101, 10]), (4096, [4097, 1])]
        .map(|(count, [width, height])| {
            crate::Case::new(&DESC, format!("{count} values"), width, height)
                .with(&[ScanParams { width, height, count, reserved: 0 }])
                .with(&crate::case::random_words(count, 3))
                .with(&crate::case::random_words(count / compact::BLOCK + 1, 4))
                .output()
        })
        .into()
}
