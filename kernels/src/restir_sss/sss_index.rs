//! Samples between passes of different shifts.

use restir_shared::technique::restir_sss::{self, PackedSubsurface, SssOrigin, SssParams};

kernel! {
    /// Gives each pixel's sample the numbers that find its point, or the point that its numbers find, in place.
    pub fn sss_index(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: SssParams,
        asks probed(features) { 1: geometry, 2: attributes, 3: texels },
        read { 4: origins: SssOrigin },
        own { 5: reservoirs: PackedSubsurface },
    }
    |x, y, at, p, scene| {
        let origin = origins[(y * p.width + x) as usize];
        reservoirs[at] = restir_sss::index(&scene, &p.specialised(settings), &origin, reservoirs[at], [x, y])
    }
}
