//! Block sums of a compaction.

use restir_shared::compact::{self, ScanParams};

kernel! {
    /// Sums 64 values an invocation.
    pub fn compact_sum(64, 1) {
        constants {}
        params 0: ScanParams,
        read { 1: values: u32 },
        own { 2: sums: u32 },
    }
    |x, y, at, p| sums[at] = compact::sum(&p, values, y * p.width + x)
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    // the last invocations of the second case have no values
    [(1_u32, [1, 1]), (1000, [5, 4]), (4096, [64, 1])]
        .map(|(count, [width, height])| {
            crate::Case::new(&DESC, format!("{count} values"), width, height)
                .with(&[ScanParams { width, height, count, reserved: 0 }])
                .with(&crate::case::random_words(count, 2))
                .output()
        })
        .into()
}
