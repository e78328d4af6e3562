//! Initial candidates of ReSTIR DI.

#[cfg(not(target_arch = "spirv"))]
use restir_shared::layout::FEATURES_UNTEXTURED;
use restir_shared::layout::FilmPixel;
use restir_shared::scene::Given;
use restir_shared::technique::restir_di::{self, DiParams, PackedHit, PackedReservoir, TileWords};

kernel! {
    /// A reservoir of each pixel's candidates, and the radiance that needs no resampling.
    pub fn di_initial(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: DiParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        deferred di_initial_deferred(p.specialised(settings).most_rays_of_initial(features)) { 8: answers, 9: rays },
        read { 4: hits: PackedHit, 5: tiles: TileWords },
        own { 6: reservoirs: PackedReservoir, 7: direct: FilmPixel },
    }
    |x, y, at, p, scene| {
        let hit = hits[(y * p.width + x) as usize];
        let scene = Given::new(scene, attributes, p.given);
        let initial = restir_di::initial(&scene, &p.specialised(settings), tiles, hit, [x, y]);
        reservoirs[at] = initial.reservoir;
        direct[at] = initial.direct
    };
    simd [FEATURES_UNTEXTURED] if (p.given.words == 0) |token| {
        let first = (y * p.width + x) as usize;
        let seen = (&hits[first..first + reservoirs.len()], [x, y]);
        restir_di::initial_row(&scene, &p.specialised(settings), tiles, seen, (reservoirs, direct), token)
    }
}
