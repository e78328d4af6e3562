//! Who shares samples with whom.

use restir_shared::resample::mutual::{self, ShiftRequest};
use restir_shared::resample::params::ReuseParams;
use restir_shared::resample::similar::PackedSurface;

kernel! {
    /// For each pixel and each of its neighbours, a request if both find each other alike.
    pub fn reuse_pair(8, 8) {
        constants {}
        params 0: ReuseParams,
        read { 1: surfaces: PackedSurface },
        own { 2: requests: ShiftRequest },
    }
    |x, y, at, p| requests[at] = mutual::pair(&p, surfaces, [x, y])
}
