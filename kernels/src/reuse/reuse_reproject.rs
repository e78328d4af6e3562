//! Where pixels' surfaces were.

use restir_shared::layout::FEATURES_ALL;
use restir_shared::resample::mutual::{self, AnyOrigin, ShiftRequest};
use restir_shared::resample::params::ReuseParams;
use restir_shared::resample::similar::PackedSurface;

kernel! {
    /// For each pixel, a request if the other frame saw its surface.
    pub fn reuse_reproject(8, 8) {
        constants {}
        params 0: ReuseParams,
        asks frames(FEATURES_ALL) { 1: geometry },
        rays crate::Rays::None,
        read { 2: origins: AnyOrigin, 3: other_surfaces: PackedSurface },
        own { 4: requests: ShiftRequest },
    }
    |x, y, at, p, frames| {
        let hit = origins[(y * p.width + x) as usize].hit.unpack();
        requests[at] = mutual::reproject(&frames, &p, &hit, other_surfaces, [x, y])
    }
}
