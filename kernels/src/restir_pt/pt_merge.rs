//! Reuse of neighbours' paths.

use restir_shared::technique::restir_pt::{self, Job, JobShifted, PackedPath, PtParams, Shares};

kernel! {
    /// Selects one path of each pixel's own and its neighbours'.
    pub fn pt_merge(8, 8) {
        constants {}
        params 0: PtParams,
        read { 1: paths: PackedPath, 2: jobs: Job, 3: shifted: JobShifted },
        own { 4: merged: PackedPath },
    }
    |x, y, at, p| merged[at] = restir_pt::merge(&p, &Shares { paths, jobs, shifted }, [x, y])
}
