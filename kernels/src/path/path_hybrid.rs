//! Path tracing with diffusion: what is traced, of one sample of every pixel.

use restir_shared::layout::FilmPixel;
use restir_shared::technique::path::hybrid::{self, HybridParams, PackedEntry};

kernel! {
    /// Begins a path and follows it to where it enters a body, across that and through one collision, and leaves the entry; or goes on with
    /// a path that waits beside an entry.
    pub fn path_hybrid(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: HybridParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        read {},
        own { 4: entries: PackedEntry, 5: film: FilmPixel },
    }
    |x, y, at, p, scene| {
        if (p.resumes == 0) | entries[at].goes_on() {
            let turn = hybrid::trace(&scene, &p.specialised(settings), entries[at], [x, y]);
            entries[at] = turn.entry;
            film[at] = turn.sample;
        }
    }
}
