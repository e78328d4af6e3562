//! Shading with neighbours, first part.

use restir_shared::scene::Given;
use restir_shared::technique::restir_di::{self, DiParams, DiPoint, PackedHit, PackedReservoir};

kernel! {
    /// What each pixel shows its neighbours.
    pub fn di_offer(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: DiParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        deferred di_offer_deferred(p.specialised(settings).most_rays_of_shade(features)) { 7: answers, 8: rays },
        read { 4: hits: PackedHit, 5: reservoirs: PackedReservoir },
        own { 6: points: DiPoint },
    }
    |x, y, at, p, scene| {
        let index = (y * p.width + x) as usize;
        let scene = Given::new(scene, attributes, p.given);
        points[at] = restir_di::offer(scene, &p.specialised(settings), hits[index], reservoirs[index], [x, y])
    }
}
