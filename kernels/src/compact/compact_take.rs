//! Items in another order.

use restir_shared::compact::{self, ScanParams};

kernel! {
    /// The value of the item of each output.
    pub fn compact_take(64, 1) {
        constants {}
        params 0: ScanParams,
        read { 1: values: u32, 2: indices: u32 },
        own { 3: taken: u32 },
    }
    |x, y, at, p| taken[at] = compact::take(&p, values, indices, y * p.width + x)
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    // the last invocations of the second case only fill the grid
    [(1_u32, [1, 1]), (1000, [100, 11]), (4096, [4096, 1])]
        .map(|(count, [width, height])| {
            let indices = crate::case::random_words(count, 7).iter().map(|word| word % count).collect::<Vec<_>>();
            crate::Case::new(&DESC, format!("{count} items"), width, height)
                .with(&[ScanParams { width, height, count, reserved: 0 }])
                .with(&crate::case::random_words(count, 6))
                .with(&indices)
                .output()
        })
        .into()
}
