//! Parameters of the kernels of ReSTIR SSS.

use crate::layout::{CameraParams, Extent};
use crate::resample::params::{Flags, LastFrame, ReuseParams, reuses};
use crate::technique::path::PathFlags;
use crate::technique::path::hybrid::Fit;
use bytemuck::{Pod, Zeroable};

impl Flags {
    /// Of ReSTIR SSS: samples are shifted by delayed reconnection. Without [`Self::BY_CRITERION`] all are.
    pub const DELAYED: Self = Self::of_technique(0);
    /// Of ReSTIR SSS, with [`Self::DELAYED`]: samples that are [far](super::is_connectable) are shifted by reconnection.
    pub const BY_CRITERION: Self = Self::of_technique(1);
}

/// Parameters of a pass. [`Self::new`] makes them; those of `default` are all zero, an image without pixels, for what writes every field that
/// counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SssParams {
    /// What all techniques of reuse have in common, as [`mutual`](crate::resample::mutual) reads it.
    pub reuse: ReuseParams,
    /// What profiles are.
    pub fit: Fit,
    /// How many segments look for candidates, at least 1 and at most [`MAX_SEGMENTS`](crate::technique::path::hybrid::MAX_SEGMENTS).
    pub segments: u32,
    /// Longest path in segments: light that enters at a point of the body ends it there.
    pub max_depth: u32,
}

const _: () = assert!(size_of::<SssParams>() == 356);

reuses!(SssParams);

impl Extent for SssParams {
    fn extent(&self) -> [u32; 2] {
        self.reuse.extent()
    }
}

impl SssParams {
    /// Parameters of a frame of its own: reconnection, one segment, whole profiles, paths of three segments. The rest is as
    /// [`ReuseParams::new`] has it, but that neighbours may be as unlike as they are: a body is round. All of it is unbiased. Requests and their
    /// answers are passes over [`Self::with_layers`].
    pub fn new(camera: CameraParams, size: [u32; 2], seed: u32) -> Self {
        let reuse =
            ReuseParams { max_plane_distance: 1.0e6, min_normal_cos: -1.0, ..ReuseParams::new(camera, size, seed) };
        Self { reuse, fit: Fit { flags: PathFlags::WHOLE, lambert_below: 0.0 }, segments: 1, max_depth: 3 }
    }

    /// See [`ReuseParams::of_frame`].
    #[must_use]
    pub fn of_frame(self, frame: u32, camera: CameraParams) -> Self {
        Self { reuse: self.reuse.of_frame(frame, camera), ..self }
    }

    /// The parameters of reuse of the last frame, where each pixel has one sample. `changed` says that the scene is not what it was; then
    /// [`super::recall`] comes first.
    #[must_use]
    pub fn with_last(self, last: &LastFrame, changed: bool) -> Self {
        // where a path enters is drawn anew each frame, so that no view stands still
        let mut reuse = self.reuse.with_last(&LastFrame { same_view: false, ..*last });
        reuse.neighbours = 1;
        reuse.flags = if changed { reuse.flags | Flags::CHANGED } else { reuse.flags };
        Self { reuse, ..self }
    }

    /// See [`ReuseParams::with_neighbours`].
    #[must_use]
    pub fn with_neighbours(self, pass: u32) -> Self {
        Self { reuse: self.reuse.with_neighbours(pass), ..self }
    }

    /// See [`ReuseParams::with_layers`].
    #[must_use]
    pub fn with_layers(self) -> Self {
        Self { reuse: self.reuse.with_layers(), ..self }
    }

    /// The same with more flags.
    #[must_use]
    pub fn with_flags(self, more: Flags) -> Self {
        Self { reuse: ReuseParams { flags: self.flags | more, ..self.reuse }, ..self }
    }

    /// See [`ReuseParams::specialised`]; the word has the flags of the fit, too.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        let fit = Fit { flags: self.fit.flags.specialised(bits), ..self.fit };
        Self { reuse: self.reuse.specialised(bits), fit, ..self }
    }

    /// Whether a flag is set.
    #[inline(always)]
    pub(super) fn has(&self, flag: Flags) -> bool {
        self.flags.contains(flag)
    }
}
