//! Where buckets begin.

use restir_shared::compact::{self, ScanParams};

kernel! {
    /// The first of the sorted words that is not below an element's index.
    pub fn compact_starts(64, 1) {
        constants {}
        params 0: ScanParams,
        read { 1: sorted: u32 },
        own { 2: starts: u32 },
    }
    |x, y, at, p| starts[at] = compact::start(&p, sorted, y * p.width + x)
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    // words, of which there are more buckets, as many, and fewer
    [(1_u32, [5, 1]), (1000, [101, 10]), (4096, [65, 1])]
        .map(|(count, [width, height])| {
            let mut words =
                crate::case::random_words(count, 8).iter().map(|word| word % (width * height)).collect::<Vec<_>>();
            words.sort_unstable();
            crate::Case::new(&DESC, format!("{count} words"), width, height)
                .with(&[ScanParams { width, height, count, reserved: 0 }])
                .with(&words)
                .output()
        })
        .into()
}
