//! Shading with neighbours, second part.

#[cfg(not(target_arch = "spirv"))]
use restir_shared::layout::FEATURES_UNTEXTURED;
use restir_shared::layout::FilmPixel;
use restir_shared::scene::Given;
use restir_shared::technique::restir_di::{self, DiPairs, DiParams, DiPoint, PackedHit};

kernel! {
    /// The targets of neighbours' samples at each pixel, and what they send by way of it.
    pub fn di_exchange(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: DiParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        deferred di_exchange_deferred(p.specialised(settings).most_rays_of_exchange(features)) { 8: answers, 9: rays },
        read { 4: hits: PackedHit, 5: points: DiPoint },
        own { 6: pairs: DiPairs, 7: film: FilmPixel },
    }
    |x, y, at, p, scene| {
        let hit = hits[(y * p.width + x) as usize];
        let scene = Given::new(scene, attributes, p.given);
        let made = restir_di::exchange(scene, &p.specialised(settings), points, hit, [x, y]);
        pairs[at] = made.pairs;
        film[at] = made.sent
    };
    simd [FEATURES_UNTEXTURED] if (p.given.words == 0) |token| {
        let first = (y * p.width + x) as usize;
        let seen = (&hits[first..first + pairs.len()], [x, y]);
        restir_di::exchange_row(&scene, &p.specialised(settings), points, seen, (pairs, film), token)
    }
}
