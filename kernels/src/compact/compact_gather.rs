//! Last pass of a compaction.

use restir_shared::compact::{self, CompactParams};

kernel! {
    /// The item of each output.
    pub fn compact_gather(64, 1) {
        constants {}
        params 0: CompactParams,
        read { 1: words: u32, 2: offsets: u32 },
        own { 3: indices: u32 },
    }
    |x, y, at, p| indices[at] = compact::gather(&p, words, offsets, y * p.width + x)
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    // items, buckets, grid
    [(1_u32, 1, [1, 1]), (1000, 1, [512, 2]), (4096, 5, [1000, 5])]
        .map(|(items, buckets, [width, height])| {
            let blocks = items.div_ceil(compact::BLOCK);
            let params = CompactParams { width, height, items, blocks, buckets, first: 1, shift: 0, mask: 7 };
            let words = crate::case::random_words(items, 5);
            let mut offsets = vec![0];
            for cell in 0..buckets * blocks {
                let found = compact::count(&params, &words, cell % blocks, cell / blocks);
                offsets.push(offsets[cell as usize] + found);
            }
            crate::Case::new(&DESC, format!("{items} items, {buckets} buckets"), width, height)
                .with(&[params])
                .with(&words)
                .with(&offsets)
                .output()
        })
        .into()
}
