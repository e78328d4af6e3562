//! Supporting prefixes near integration prefixes.

use restir_shared::layout::FEATURES_ALL;
use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_suffix::{Nearest, PrefixGrid, PrefixPoint, SuffixParams};

kernel! {
    /// Finds the pixels whose supporting prefixes end nearest to the end of each pixel's integration prefix.
    pub fn suffix_find(8, 8) {
        constants {}
        params 0: SuffixParams,
        asks scene(FEATURES_ALL) { 1: geometry },
        rays crate::Rays::None,
        read { 2: ends: PathOrigin, 3: points: PrefixPoint, 4: order: u32, 5: starts: u32 },
        own { 6: nearest: Nearest },
    }
    |x, y, at, p, scene| {
        let point = PrefixPoint::new(&scene, &p, &ends[(y * p.width + x) as usize]);
        nearest[at] = PrefixGrid { points, order, starts }.nearest(&p, &point)
    }
}
