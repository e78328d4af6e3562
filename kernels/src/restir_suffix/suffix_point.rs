//! Ends of prefixes, as others look for them.

use restir_shared::layout::FEATURES_ALL;
use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_suffix::{PrefixPoint, SuffixParams};

kernel! {
    /// Where each pixel's supporting prefix ends, and in which bucket of the grid that is.
    pub fn suffix_point(8, 8) {
        constants {}
        params 0: SuffixParams,
        asks scene(FEATURES_ALL) { 1: geometry },
        rays crate::Rays::None,
        read { 2: origins: PathOrigin },
        own { 3: points: PrefixPoint, 4: words: u32 },
    }
    |x, y, at, p, scene| {
        let point = PrefixPoint::new(&scene, &p, &origins[(y * p.width + x) as usize]);
        points[at] = point;
        words[at] = point.bucket(p.buckets)
    }
}
