//! Path tracing with diffusion: from where paths have left bodies, of one sample of every pixel.

use restir_shared::layout::FilmPixel;
use restir_shared::technique::path::hybrid::{self, HybridParams, PackedEntry, PackedExit};

kernel! {
    /// Goes on with the paths beside entries, across bodies and through one collision.
    pub fn path_exits(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: HybridParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        read { 4: entries: PackedEntry, 5: exits: PackedExit },
        own { 6: film: FilmPixel },
    }
    |x, y, at, p, scene| {
        let index = (y * p.path.width + x) as usize;
        if entries[index].is_inside() {
            film[at] = hybrid::leave(&scene, &p.specialised(settings), entries[index], exits[index], p.path.in_image([x, y]));
        }
    }
}
