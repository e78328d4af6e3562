//! First pass of ReSTIR DI.

#[cfg(not(target_arch = "spirv"))]
use restir_shared::layout::FEATURES_UNTEXTURED;
use restir_shared::technique::restir_di::{self, DiParams, PackedHit};

kernel! {
    /// What each pixel sees.
    pub fn di_primary(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: DiParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        rays crate::Rays::Deferrable(&super::di_primary_deferred::DEFERRED),
        read {},
        own { 4: hits: PackedHit },
    }
    |x, y, at, p, scene| hits[at] = restir_di::primary(&scene, &p.specialised(settings), [x, y]);
    simd [FEATURES_UNTEXTURED] |token|
        restir_di::primary_row(&scene, &p.specialised(settings), [x, y], hits, token)
}
