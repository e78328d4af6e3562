//! Paths in planes, as what [`mutual`](crate::resample::mutual) shifts and merges.

use super::recall::carry;
use super::{PackedPath, PathNumbers, PtParams};
use crate::num;
use crate::resample::mutual::{Record, Shift, ShiftResult};
use crate::resample::params::Flags;
use crate::scene::Frames;
use crate::shift::{self, PathOrigin, Shifted};
use glam::Vec3;

impl PackedPath {
    /// The path at an origin; with [`Flags::BACK`] it is a path of this frame, and the origin one of the other frame.
    #[inline(always)]
    pub fn shifted<F: Frames>(&self, frames: &F, params: &PtParams, origin: &PathOrigin) -> Shifted {
        let (back, changed) = (params.has(Flags::BACK), params.has(Flags::CHANGED));
        let mut path = self.unpack().path;
        let mut extent = 1.0;
        if back & changed {
            // what comes the other way has been recalled
            extent = carry(frames, params, false, &mut path);
        }
        let numbers = PathNumbers::of_key(path.key, params.seed, params.flags.sampler());
        let shifted = shift::shift(&frames.scene(back), &numbers, &params.hybrid, origin, &path, changed);
        Shifted { term: num::flush(shifted.term * extent), ..shifted }
    }
}

impl Record for PackedPath {
    #[inline(always)]
    fn value(&self) -> Vec3 {
        self.value()
    }

    #[inline(always)]
    fn contribution_weight(&self) -> f32 {
        self.contribution_weight()
    }

    #[inline(always)]
    fn confidence(&self) -> f32 {
        self.confidence()
    }

    #[inline(always)]
    fn partial_jacobian(&self) -> f32 {
        self.term()
    }

    #[inline(always)]
    fn moved(&self, to: &ShiftResult) -> Self {
        self.moved(Vec3::from_array(to.value), to.partial_jacobian)
    }

    #[inline(always)]
    fn weighted(&self, contribution_weight: f32, confidence: f32) -> Self {
        self.weighted(contribution_weight, confidence)
    }
}

impl Shift for PackedPath {
    type Params = PtParams;
    type Origin = PathOrigin;

    #[inline(always)]
    fn shift<F: Frames>(&self, frames: &F, params: &PtParams, origin: &PathOrigin) -> ShiftResult {
        let Shifted { value, term, .. } = self.shifted(frames, params, origin);
        ShiftResult { value: value.to_array(), partial_jacobian: term }
    }
}
