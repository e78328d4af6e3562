//! Shifts of paths.

use restir_shared::shift::Start;
use restir_shared::technique::restir_pt::{self, Job, JobShifted, PackedPath, PtParams};

kernel! {
    /// Takes each job's path to the job's start.
    pub fn pt_shift(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: PtParams,
        asks frames(features) { 1: geometry, 2: attributes, 3: texels },
        read { 4: jobs: Job, 5: starts: Start, 6: paths: PackedPath },
        own { 7: shifted: JobShifted },
    }
    |x, y, at, p, frames| {
        let job = jobs[(y * p.width + x) as usize];
        shifted[at] = restir_pt::shift_job(&frames, &p.specialised(settings), job, starts, paths)
    }
}
