//! Path tracing, one block of samples of every pixel.

use restir_shared::layout::FilmPixel;
#[cfg(not(target_arch = "spirv"))]
use restir_shared::layout::{FEATURE_ENVIRONMENT, FEATURES_DIFFUSE, FEATURES_UNTEXTURED};
use restir_shared::technique;
use restir_shared::technique::path::PathParams;

kernel! {
    /// Sums the radiance of 2^`block_log2` samples of each pixel.
    pub fn path(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff, 2: block = 0xffff_ffff }
        params 0: PathParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels } compiled [FEATURES_DIFFUSE],
        deferred path_deferred(p.specialised(settings).in_blocks(block).most_rays()) { 5: answers, 6: rays },
        read {},
        own { 4: film: FilmPixel },
    }
    |x, y, at, p, scene| {
        let [column, row] = p.in_image([x, y]);
        film[at] = technique::path::pixel(&scene, &p.specialised(settings).in_blocks(block), column, row);
    };
    simd [FEATURES_DIFFUSE, FEATURE_ENVIRONMENT, FEATURES_UNTEXTURED, FEATURES_UNTEXTURED | FEATURE_ENVIRONMENT]
    |token| technique::path::pixels(&scene, &p.specialised(settings).in_blocks(block), p.in_image([x, y]), film, token)
}
