//! Temporal and spatial reuse of ReSTIR DI.

use restir_shared::glam::UVec4;
use restir_shared::technique::restir_di::{self, DiParams};

kernel! {
    /// Each pixel's reservoir, combined with others: of the last frame in place, of the same frame into another plane.
    pub fn di_combine(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: DiParams,
        asks frames(features) { 1: geometry, 2: attributes, 3: texels },
        read { 4: hits: UVec4, 5: other_hits: UVec4, 6: others: UVec4 },
        own { 7: reservoirs: UVec4 },
    }
    |x, y, at, p, frames| {
        let planes = restir_di::Planes { hits, other_hits, others };
        reservoirs[at] = restir_di::combine(frames, &p, p.flags & settings, &planes, reservoirs[at], [x, y])
    }
}
