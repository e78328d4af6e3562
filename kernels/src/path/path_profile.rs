//! Path tracing with diffusion: what is not traced, of one sample of every pixel.

use restir_shared::layout::FilmPixel;
use restir_shared::technique::path::hybrid::{self, HybridParams, PackedEntry};

kernel! {
    /// Adds the light of a profile's points to the paths that wait at entries.
    pub fn path_profile(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: HybridParams,
        asks probed(features) { 1: geometry, 2: attributes, 3: texels },
        read {},
        own { 4: entries: PackedEntry, 5: film: FilmPixel },
    }
    |x, y, at, p, scene| {
        if entries[at].is_inside() {
            let turn = hybrid::gather(&scene, &p.specialised(settings), entries[at], [x, y]);
            entries[at] = turn.entry;
            film[at] = turn.sample;
        }
    }
}
