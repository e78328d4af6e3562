//! Parameters of the kernels of ReSTIR PT.

use crate::layout::{CameraParams, Extent};
use crate::resample::params::{Flags, LastFrame, ReuseParams, reuses};
use crate::shift::Hybrid;
use bytemuck::{Pod, Zeroable};

impl Flags {
    /// Of ReSTIR PT, with [`Self::CHANGED`]: paths that keep what arrives at vertex k are taken to the other frame, too, with what the plane
    /// has of it: [`retrace`](super::retrace) has found it there, or else it is stale.
    pub const TAKES_ALL: Self = Self::of_technique(0);
    /// Of ReSTIR PT: another technique supplies paths of up to two segments.
    pub const INDIRECT_ONLY: Self = Self::of_technique(1);
}

/// Parameters of a pass. [`Self::new`] makes them; those of `default` are all zero, an image without pixels, for what writes every field that
/// counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PtParams {
    /// What all techniques of reuse have in common, as [`mutual`](crate::resample::mutual) reads it.
    pub reuse: ReuseParams,
    /// Where paths are joined.
    pub hybrid: Hybrid,
    /// Longest path in segments, at most 255.
    pub max_depth: u32,
}

crate::fields!(PtParams: reuse, hybrid, max_depth);

const _: () = assert!(size_of::<PtParams>() == 364);

reuses!(PtParams, in pairs);

impl Extent for PtParams {
    fn extent(&self) -> [u32; 2] {
        self.reuse.extent()
    }
}

impl PtParams {
    /// Parameters of a frame of its own, whose passes are [`super::trace`], [`pair`](crate::resample::mutual::pair),
    /// [`answer`](crate::resample::mutual::answer), [`merge`](crate::resample::mutual::merge) and [`shade`](crate::resample::mutual::shade).
    ///
    /// Paths have up to 8 segments and are joined by footprint, as the defaults of the program have it; the rest is as
    /// [`ReuseParams::new`] has it. All of it is unbiased. Requests and their answers are passes over [`Self::with_layers`].
    pub fn new(camera: CameraParams, size: [u32; 2], seed: u32) -> Self {
        let reuse = ReuseParams::new(camera, size, seed);
        Self { reuse, hybrid: Hybrid::by_footprint(0.02, 0.1), max_depth: 8 }
    }

    /// The parameters of reuse of the last frame, where each pixel has one path. `changed` says that the scene is not what it was; then
    /// [`super::recall`] or [`super::retrace`] comes first.
    #[must_use]
    pub fn with_last(self, last: &LastFrame, changed: bool) -> Self {
        let mut reuse = ReuseParams { neighbours: 1, ..self.reuse.with_last(last) };
        reuse.flags = if changed { reuse.flags | Flags::CHANGED } else { reuse.flags };
        Self { reuse, ..self }
    }

    /// How many rays an initial path asks for at most: along each segment, and from each vertex but the last one to a light.
    #[doc(hidden)]
    #[cfg(not(target_arch = "spirv"))]
    pub fn most_rays_of_path(&self) -> u32 {
        2 * self.max_depth
    }

    /// How many rays a shift asks for at most: one to each vertex after the first, and one to the light.
    #[doc(hidden)]
    #[cfg(not(target_arch = "spirv"))]
    pub fn most_rays_of_shift(&self) -> u32 {
        self.max_depth + 1
    }

    /// See [`ReuseParams::specialised`].
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { reuse: self.reuse.specialised(bits), ..self }
    }
}
