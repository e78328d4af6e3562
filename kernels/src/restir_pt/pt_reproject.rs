//! Where pixels' surfaces were.

use restir_shared::layout::FEATURES_ALL;
use restir_shared::shift::Start;
use restir_shared::technique::restir_pt::{self, Job, PtFacet, PtParams};

kernel! {
    /// For each pixel, a job if the other frame saw its surface.
    pub fn pt_reproject(8, 8) {
        constants {}
        params 0: PtParams,
        asks frames(FEATURES_ALL) { 1: geometry },
        read { 2: starts: Start, 3: other_facets: PtFacet },
        own { 4: jobs: Job },
    }
    |x, y, at, p, frames| jobs[at] = restir_pt::reproject(&frames, &p, starts, other_facets, [x, y])
}
