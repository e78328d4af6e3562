//! What follows vertex k of paths in a scene that has changed.

use restir_shared::technique::restir_pt::{self, PackedPath, PtParams};

kernel! {
    /// Takes each pixel's path of the other frame to this frame's scene, or what arrives at its own path's vertex k to the other one's.
    pub fn pt_retrace(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: PtParams,
        asks frames(features) { 1: geometry, 2: attributes, 3: texels },
        deferred pt_retrace_deferred(p.most_rays_of_shift()) { 6: answers, 7: rays },
        read { 4: reservoirs: PackedPath },
        own { 5: retraced: PackedPath },
    }
    |x, y, at, p, frames| {
        let path = reservoirs[(y * p.width + x) as usize];
        retraced[at] = restir_pt::retrace(&frames, &p.specialised(settings), path)
    }
}
