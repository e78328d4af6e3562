//! Who shares paths with whom.

use restir_shared::technique::restir_pt::{self, Job, PtFacet, PtParams};

kernel! {
    /// For each pixel and each of its neighbours, a job if both find each other alike.
    pub fn pt_pair(8, 8) {
        constants {}
        params 0: PtParams,
        read { 1: facets: PtFacet },
        own { 2: jobs: Job },
    }
    |x, y, at, p| jobs[at] = restir_pt::pair(&p, facets, [x, y])
}
