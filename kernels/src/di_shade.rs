//! Last pass of ReSTIR DI.

use restir_shared::glam::UVec4;
use restir_shared::layout::{DiParams, FilmPixel};
use restir_shared::scene::SceneView;
use restir_shared::technique::di;

kernel! {
    /// The radiance of each pixel from its reservoir, or from several, as a film's sample.
    pub fn di_shade(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: DiParams,
        read {
            1: geometry: UVec4, 2: attributes: UVec4, 3: texels: UVec4,
            4: hits: UVec4, 5: reservoirs: UVec4, 6: direct: FilmPixel,
        },
        own { 7: film: FilmPixel },
    }
    |x, y, at, p, tracer| {
        let scene: SceneView<'_> = SceneView { header: p.scene, geometry, attributes, texels, features, tracer };
        let planes = di::Planes { hits, other_hits: hits, others: reservoirs };
        film[at] = di::shade(&scene, &p, p.flags & settings, &planes, direct[(y * p.width + x) as usize], [x, y])
    }
}

#[cfg(not(target_arch = "spirv"))]
fn cases(scenes: &dyn crate::CaseScenes) -> Vec<crate::Case> {
    use restir_shared::layout::{DI_MIS_SHIFT, DI_OTHER_FRAME};
    use restir_shared::mis::Mis;
    crate::di_cases::make_with(
        scenes,
        |params| {
            // forms that act after the selection shade one reservoir
            let form = Mis((params.flags >> DI_MIS_SHIFT) & Mis::MASK);
            params.flags &= !DI_OTHER_FRAME;
            params.neighbours = if form.is_after_selection() { 0 } else { params.neighbours };
        },
        |chain, case| case.with(&chain.hits[1]).with(&chain.reservoirs[1]).with(&chain.direct).output(),
    )
}
