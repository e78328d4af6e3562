//! Supporting prefixes of the last frame.

use restir_shared::resample::mutual::ShiftRequest;
use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_suffix::{self, SuffixParams};

kernel! {
    /// Puts the last frame's prefix in the place of each pixel's new one, if it is kept.
    pub fn suffix_keep(8, 8) {
        constants {}
        params 0: SuffixParams,
        read { 1: other_origins: PathOrigin },
        own { 2: origins: PathOrigin, 3: requests: ShiftRequest },
    }
    |x, y, at, p| {
        let kept = restir_suffix::keep(&p, requests[at], origins[at], other_origins, [x, y]);
        origins[at] = kept.origin;
        requests[at] = kept.request
    }
}
