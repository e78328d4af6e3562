//! Temporal and spatial reuse of ReSTIR DI.

#[cfg(not(target_arch = "spirv"))]
use restir_shared::layout::FEATURES_UNTEXTURED;
use restir_shared::scene::Given;
use restir_shared::technique::restir_di::{self, DiParams, PackedHit, PackedReservoir, Planes};

kernel! {
    /// Each pixel's reservoir, combined with others: of the last frame in place, of the same frame into another plane.
    pub fn di_combine(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: DiParams,
        asks frames(features) { 1: geometry, 2: attributes, 3: texels },
        deferred di_combine_deferred(p.specialised(settings).most_rays_of_combine(features)) { 8: answers, 9: rays },
        read { 4: hits: PackedHit, 5: other_hits: PackedHit, 6: others: PackedReservoir },
        own { 7: reservoirs: PackedReservoir },
    }
    |x, y, at, p, frames| {
        let planes = Planes { hits, other_hits, others };
        let frames = Given::new(frames, attributes, p.given);
        reservoirs[at] = restir_di::combine(frames, &p.specialised(settings), &planes, reservoirs[at], [x, y]).reservoir
    };
    simd [FEATURES_UNTEXTURED] if (p.given.words == 0) |token| {
        let planes = Planes { hits, other_hits, others };
        restir_di::combine_row(&frames, &p.specialised(settings), &planes, [x, y], reservoirs, token)
    }
}
