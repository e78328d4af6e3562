//! New supporting prefixes.

use restir_shared::resample::similar::PackedSurface;
use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_suffix::{self, SuffixParams};

kernel! {
    /// Traces a supporting prefix from each pixel: where it ends, and what the pixel sees.
    pub fn suffix_support(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: SuffixParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        read {},
        own { 4: origins: PathOrigin, 5: seen: PathOrigin, 6: surfaces: PackedSurface },
    }
    |x, y, at, p, scene| {
        let p = p.specialised(settings);
        let prefix = restir_suffix::prefix(&scene, &p, &p.supporting([x, y]), false, [x, y]);
        origins[at] = prefix.end;
        seen[at] = prefix.seen;
        surfaces[at] = prefix.surface
    }
}
