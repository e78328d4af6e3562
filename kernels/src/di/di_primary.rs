//! First pass of ReSTIR DI.

use restir_shared::glam::UVec4;
use restir_shared::technique::di::DiParams;
#[cfg(not(target_arch = "spirv"))]
use restir_shared::technique::di::DI_JITTER;
use restir_shared::technique::di;

kernel! {
    /// What each pixel sees.
    pub fn di_primary(8, 8) {
        constants { 0: settings = 0xffff_ffff }
        params 0: DiParams,
        // rays need no more
        asks scene(0) { 1: geometry },
        read {},
        own { 2: hits: UVec4 },
    }
    |x, y, at, p, scene| hits[at] = di::primary(&scene, &p, p.flags & settings, [x, y])
}

#[cfg(not(target_arch = "spirv"))]
fn cases(scenes: &dyn crate::CaseScenes) -> Vec<crate::Case> {
    [("cornell", 0), ("tower", DI_JITTER)]
        .map(|(name, flags)| {
            let scene = scenes.scene(name);
            let camera = (scene.camera)(20, 14);
            let size = DiParams { width: 20, height: 14, seed: 3, ..DiParams::default() };
            let params = DiParams { scene: scene.header, camera, frame: 2, flags, ..size };
            crate::Case::new(name, 20, 14).with(&[params]).with(&scene.geometry).output()
        })
        .into()
}
