//! First pass of ReSTIR DI.

use restir_shared::glam::UVec4;
use restir_shared::technique::restir_di::{self, DiParams};

kernel! {
    /// What each pixel sees.
    pub fn di_primary(8, 8) {
        constants { 0: settings = 0xffff_ffff }
        params 0: DiParams,
        // rays need no more
        asks scene(0) { 1: geometry },
        read {},
        own { 2: hits: UVec4 },
    }
    |x, y, at, p, scene| hits[at] = restir_di::primary(&scene, &p, p.flags & settings, [x, y])
}
