//! Path tracing with diffusion: what is not traced, of one sample of every pixel.

use restir_shared::layout::FilmPixel;
use restir_shared::technique::path::hybrid::{self, HybridParams, PackedEntry, PackedExit};

kernel! {
    /// Adds the light of a profile's points to the paths that wait at entries.
    pub fn path_profile(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: HybridParams,
        asks probed(features) { 1: geometry, 2: attributes, 3: texels },
        read { 4: entries: PackedEntry },
        own { 5: exits: PackedExit, 6: film: FilmPixel },
    }
    |x, y, at, p, scene| {
        let index = (y * p.path.width + x) as usize;
        if entries[index].is_inside() {
            let gathered = hybrid::gather(&scene, &p.specialised(settings), entries[index], p.path.in_image([x, y]));
            exits[at] = gathered.exit;
            film[at] = gathered.sample;
        }
    }
}
