//! Parameters of the kernels of ReSTIR SSS.

use crate::camera::spread;
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
    /// Which profiles: the flags of [`Fit`].
    pub profile: PathFlags,
    /// Channels of a mean free path that is shorter than so many pixels are Lambertian.
    pub lambert_below: f32,
    /// Of [`Flags::BY_CRITERION`]: points farther than so many pixels from the entry are reconnected, too.
    pub reconnected_beyond: f32,
    /// How many segments look for candidates, at least 1 and at most [`MAX_SEGMENTS`](crate::technique::path::hybrid::MAX_SEGMENTS).
    pub segments: u32,
    /// Longest path in segments: light that enters at a point of the body ends it there.
    pub max_depth: u32,
}

crate::fields!(SssParams: reuse, profile, lambert_below, reconnected_beyond, segments, max_depth);

const _: () = assert!(size_of::<SssParams>() == 360);

reuses!(SssParams, in pairs);

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
        let (lambert_below, reconnected_beyond) = (0.0, 2.0);
        Self { reuse, profile: PathFlags::WHOLE, lambert_below, reconnected_beyond, segments: 1, max_depth: 3 }
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

    /// See [`ReuseParams::specialised`]; the word has the flags of the profile, too.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { reuse: self.reuse.specialised(bits), profile: self.profile.specialised(bits), ..self }
    }

    /// The height of a pixel at the distance 1 from the camera of this frame, or of the other one.
    #[inline(always)]
    pub(super) fn spread(&self, of_other: bool) -> f32 {
        if of_other { spread(&self.other_camera) } else { spread(&self.camera) }
    }

    /// What profiles are where a pixel at the distance 1 has this height.
    #[inline(always)]
    pub(super) fn fit(&self, spread: f32) -> Fit {
        Fit { flags: self.profile, lambert_below: self.lambert_below * spread }
    }
}
