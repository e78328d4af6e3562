//! Initial samples.

use restir_shared::resample::similar::PackedSurface;
use restir_shared::technique::path::hybrid::PackedEntry;
use restir_shared::technique::restir_sss::{self, PackedSubsurface, SssOrigin, SssParams};

kernel! {
    /// Looks for points of the profile where each pixel's path enters a body, and keeps one with its light.
    pub fn sss_initial(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: SssParams,
        asks probed(features) { 1: geometry, 2: attributes, 3: texels },
        read { 4: entries: PackedEntry },
        own { 5: origins: SssOrigin, 6: surfaces: PackedSurface, 7: reservoirs: PackedSubsurface },
    }
    |x, y, at, p, scene| {
        let entry = entries[(y * p.width + x) as usize];
        let initial = restir_sss::initial(&scene, &p.specialised(settings), entry, [x, y]);
        origins[at] = initial.origin;
        surfaces[at] = initial.surface;
        reservoirs[at] = initial.reservoir
    }
}
