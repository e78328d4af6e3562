//! Initial paths.

use restir_shared::layout::FilmPixel;
use restir_shared::resample::similar::PackedSurface;
use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_pt::{self, PackedPath, PtParams};

kernel! {
    /// Traces the path of each pixel, and keeps one of the times that it finds light.
    pub fn pt_trace(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: PtParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        deferred pt_trace_deferred(p.most_rays_of_path()) { 8: answers, 9: rays },
        read {},
        own { 4: origins: PathOrigin, 5: surfaces: PackedSurface, 6: reservoirs: PackedPath, 7: direct: FilmPixel },
    }
    |x, y, at, p, scene| {
        let traced = restir_pt::trace(&scene, &p.specialised(settings), [x, y]);
        origins[at] = traced.origin;
        surfaces[at] = traced.surface;
        reservoirs[at] = traced.path;
        direct[at] = traced.direct
    }
}
