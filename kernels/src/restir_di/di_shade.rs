//! Last pass of ReSTIR DI, where each pixel shades its own sample.

use restir_shared::layout::FilmPixel;
use restir_shared::scene::Given;
use restir_shared::technique::restir_di::{self, DiParams, PackedHit, PackedReservoir};

kernel! {
    /// The radiance of each pixel by way of its reservoir, as a film's sample.
    pub fn di_shade(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: DiParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        deferred di_shade_deferred(p.specialised(settings).most_rays_of_shade(features)) { 8: answers, 9: rays },
        read { 4: hits: PackedHit, 5: reservoirs: PackedReservoir, 6: direct: FilmPixel },
        own { 7: film: FilmPixel },
    }
    |x, y, at, p, scene| {
        let index = (y * p.width + x) as usize;
        let scene = Given::new(scene, attributes, p.given);
        film[at] = restir_di::shade(scene, &p.specialised(settings), hits[index], reservoirs[index], direct[index], [x, y])
    }
}
