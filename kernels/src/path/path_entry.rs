//! Path tracing with diffusion: as far as paths go outside, of one sample of every pixel.

use restir_shared::layout::FilmPixel;
use restir_shared::technique::path::hybrid::{self, HybridParams, PackedEntry};

kernel! {
    /// Begins a path and follows it to where it enters a body, and leaves the entry.
    pub fn path_entry(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: HybridParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        read {},
        own { 4: entries: PackedEntry, 5: film: FilmPixel },
    }
    |x, y, at, p, scene| {
        let entered = hybrid::enter(&scene, &p.specialised(settings), p.path.in_image([x, y]));
        entries[at] = entered.entry;
        film[at] = entered.sample;
    }
}
