//! The final gather.

use restir_shared::layout::FilmPixel;
use restir_shared::resample::mutual::ShiftResult;
use restir_shared::technique::restir_pt::PackedPath;
use restir_shared::technique::restir_suffix::{Lent, Nearest, SuffixParams, Throughput};

kernel! {
    /// Adds what borrowed suffixes send along each pixel's integration prefix to the picture.
    pub fn suffix_gather(8, 8) {
        constants {}
        params 0: SuffixParams,
        read {
            1: reservoirs: PackedPath,
            2: nearest: Nearest,
            3: results: ShiftResult,
            4: crossed: ShiftResult,
            5: throughputs: Throughput,
        },
        own { 6: film: FilmPixel },
    }
    |x, y, at, p| {
        let pixel = y * p.width + x;
        let lent = Lent { records: reservoirs, nearest, results };
        film[at] = throughputs[pixel as usize].add(film[at], lent.borrowed(&p, crossed, pixel))
    }
}
