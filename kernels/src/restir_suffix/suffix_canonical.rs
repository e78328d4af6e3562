//! Canonical suffixes in the final gather.

use restir_shared::layout::FilmPixel;
use restir_shared::resample::mutual::ShiftResult;
use restir_shared::technique::restir_pt::PackedPath;
use restir_shared::technique::restir_suffix::{Lent, Nearest, SuffixParams, Throughput};

kernel! {
    /// Adds what the suffix of each pixel's integration prefix sends along it to the picture.
    pub fn suffix_canonical(8, 8) {
        constants {}
        params 0: SuffixParams,
        read {
            1: reservoirs: PackedPath,
            2: canonical: PackedPath,
            3: nearest: Nearest,
            4: results: ShiftResult,
            5: throughputs: Throughput,
        },
        own { 6: film: FilmPixel },
    }
    |x, y, at, p| {
        let pixel = y * p.width + x;
        let lent = Lent { records: reservoirs, nearest, results };
        let light = lent.canonical(&p, &canonical[pixel as usize], pixel);
        film[at] = throughputs[pixel as usize].add(film[at], light)
    }
}
