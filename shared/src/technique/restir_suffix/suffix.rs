//! Suffixes: what paths find from the end of a prefix on.

use crate::scene::{AddressedLights, Surface, Trace};
use crate::shift::PathOrigin;
use crate::technique::restir_pt::{PackedPath, PathNumbers, PtParams, trace_from};

/// The suffix of the pixel `at`, whose prefix ends at `origin`: one of the paths to light that begin there.
#[inline(always)]
pub fn suffix<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &PtParams,
    origin: &PathOrigin,
    at: [u32; 2],
) -> PackedPath {
    if origin.segments() == 0 {
        // nobody looks for one
        return PackedPath::default();
    }
    trace_from(scene, params, &PathNumbers::new(params.rng(at)), origin)
}
