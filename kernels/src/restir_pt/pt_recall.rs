//! Paths in a scene that has changed.

use restir_shared::layout::FEATURES_ALL;
use restir_shared::technique::restir_pt::{self, PackedPath, PtParams};

kernel! {
    /// Takes each pixel's path of the other frame to this frame's scene, in place.
    pub fn pt_recall(8, 8) {
        constants { 0: settings = 0xffff_ffff }
        params 0: PtParams,
        asks frames(FEATURES_ALL) { 1: geometry, 2: attributes },
        rays crate::Rays::None,
        read {},
        own { 3: reservoirs: PackedPath },
    }
    |x, _y, at, p, frames| reservoirs[at] = restir_pt::recall(&frames, &p.specialised(settings), reservoirs[at])
}
