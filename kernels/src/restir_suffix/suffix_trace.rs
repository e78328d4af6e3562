//! New suffixes.

use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_pt::{PackedPath, PtParams};
use restir_shared::technique::restir_suffix;

kernel! {
    /// Traces a suffix from the end of each pixel's prefix, and keeps one of the times that it finds light.
    pub fn suffix_trace(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: PtParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        read { 4: origins: PathOrigin },
        own { 5: reservoirs: PackedPath },
    }
    |x, y, at, p, scene| {
        let origin = origins[(y * p.width + x) as usize];
        reservoirs[at] = restir_suffix::suffix(&scene, &p.specialised(settings), &origin, [x, y])
    }
}
