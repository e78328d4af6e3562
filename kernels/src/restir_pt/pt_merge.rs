//! Reuse of neighbours' paths.

use restir_shared::technique::restir_pt::{self, Job, JobShifted, PT_OTHER_FRAME, PackedPath, PtParams, Shares};

kernel! {
    /// Selects one path of each pixel's own and its neighbours', or of its own, which is in place then, and the other frame's.
    pub fn pt_merge(8, 8) {
        constants { 0: settings = 0xffff_ffff }
        params 0: PtParams,
        read { 1: paths: PackedPath, 2: jobs: Job, 3: shifted: JobShifted, 4: returned: JobShifted },
        own { 5: merged: PackedPath },
    }
    |x, y, at, p| {
        let p = p.specialised(settings);
        let own = if p.flags & PT_OTHER_FRAME != 0 { merged[at] } else { paths[(y * p.width + x) as usize] };
        merged[at] = restir_pt::merge(&p, &Shares { paths, jobs, shifted, returned }, own, [x, y]).path
    }
}
