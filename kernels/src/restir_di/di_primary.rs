//! First pass of ReSTIR DI.

use restir_shared::technique::restir_di::{self, DiParams, PackedHit};

kernel! {
    /// What each pixel sees.
    pub fn di_primary(8, 8) {
        constants { 0: settings = 0xffff_ffff }
        params 0: DiParams,
        // rays need no more
        asks scene(0) { 1: geometry },
        read {},
        own { 2: hits: PackedHit },
    }
    |x, y, at, p, scene| hits[at] = restir_di::primary(&scene, &p.specialised(settings), [x, y])
}
