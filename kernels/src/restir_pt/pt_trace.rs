//! Initial paths.

use restir_shared::layout::FilmPixel;
use restir_shared::shift::Start;
use restir_shared::technique::restir_pt::{self, PackedPath, PtFacet, PtParams};

kernel! {
    /// Traces the path of each pixel, and keeps one of the times that it finds light.
    pub fn pt_trace(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: PtParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        read {},
        own { 4: starts: Start, 5: facets: PtFacet, 6: paths: PackedPath, 7: direct: FilmPixel },
    }
    |x, y, at, p, scene| {
        let traced = restir_pt::trace(&scene, &p.specialised(settings), [x, y]);
        starts[at] = traced.start;
        facets[at] = traced.facet;
        paths[at] = traced.path;
        direct[at] = traced.direct
    }
}
