//! Samples in a scene that has changed.

use restir_shared::layout::FEATURES_ALL;
use restir_shared::technique::restir_sss::{self, PackedSubsurface, SssParams};

kernel! {
    /// Takes each pixel's sample of the other frame to this frame's scene, in place.
    pub fn sss_recall(8, 8) {
        constants {}
        params 0: SssParams,
        asks frames(FEATURES_ALL) { 1: attributes },
        rays crate::Rays::None,
        read {},
        own { 2: reservoirs: PackedSubsurface },
    }
    |x, _y, at, p, frames| reservoirs[at] = restir_sss::recall(&frames, reservoirs[at])
}
