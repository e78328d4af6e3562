//! Path tracing, one block of samples of every pixel.

#[cfg(not(target_arch = "spirv"))]
use restir_shared::layout::FEATURES_DIFFUSE;
use restir_shared::layout::FilmPixel;
use restir_shared::technique::path::PathParams;
use restir_shared::technique;

kernel! {
    /// Sums the radiance of 2^`block_log2` samples of each pixel.
    pub fn path(8, 8) {
        constants { 0: features = 0xffff_ffff }
        params 0: PathParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels } compiled [FEATURES_DIFFUSE],
        read {},
        own { 4: film: FilmPixel },
    }
    |x, y, at, p, scene| film[at] = technique::path::pixel(&scene, &p, x, y)
}

/// Name, scene, size, block, first sample, seed, depth, flags.
#[cfg(not(target_arch = "spirv"))]
type Row = (&'static str, &'static str, [u32; 2], u32, u32, u32, u32, u32);

#[cfg(not(target_arch = "spirv"))]
fn cases(scenes: &dyn crate::CaseScenes) -> Vec<crate::Case> {
    use restir_shared::layout::FEATURES_ALL;
    use restir_shared::technique::path::{PATH_JITTER, PATH_ROULETTE};
    let rows: [Row; 9] = [
        ("cornell, 1 sample", "cornell", [24, 24], 0, 0, 1, 8, 0),
        ("cornell, a later block", "cornell", [17, 11], 2, 12, 7, 8, PATH_JITTER),
        ("cornell, roulette", "cornell", [16, 16], 1, 0, 3, 32, PATH_JITTER | PATH_ROULETTE),
        ("cornell-mitsuba, one pixel", "cornell-mitsuba", [1, 1], 3, 0, 0xffff_ffff, 8, 0),
        ("furnace, many lights", "furnace", [16, 9], 0, 5, 2, 5, PATH_JITTER),
        ("depth 1", "cornell", [16, 16], 0, 0, 1, 1, 0),
        ("all materials", "glass", [20, 14], 1, 0, 4, 12, PATH_JITTER),
        ("rough metal and plastic", "glossy", [20, 14], 1, 0, 5, 8, PATH_JITTER),
        ("environment", "tower", [20, 14], 1, 0, 6, 6, PATH_JITTER),
    ];
    let mut cases = Vec::new();
    for (name, scene, [width, height], block_log2, first_sample, seed, max_depth, flags) in rows {
        let scene = scenes.scene(scene);
        let camera = (scene.camera)(width, height);
        let header = scene.header;
        let params = PathParams {
            scene: header,
            camera,
            width,
            height,
            first_sample,
            block_log2,
            seed,
            max_depth,
            flags,
            reserved: 0,
        };
        // the general kernel and the one frozen to the scene
        for features in [FEATURES_ALL, scene.features] {
            let kind = if features == FEATURES_ALL { "general" } else { "frozen" };
            cases.push(
                crate::Case::new(format!("{name}, {kind}"), width, height)
                    .freeze(0, features)
                    .with(&[params])
                    .with(&scene.geometry)
                    .with(&scene.attributes)
                    .with(&scene.texels)
                    .output(),
            );
        }
    }
    cases
}
