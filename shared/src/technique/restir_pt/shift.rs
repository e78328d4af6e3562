//! Paths in planes, as what [`mutual`](crate::resample::mutual) shifts.

use super::recall::carry;
use super::{PackedPath, PathNumbers, PtParams};
use crate::num;
use crate::resample::mutual::{Cause, Shift, Shifted};
use crate::resample::params::Flags;
use crate::scene::Frames;
use crate::shift::{self, KeptPath, Path, PathOrigin};

/// A path in the frame of the origin that it is shifted to. What comes the other way has been recalled.
struct Carried<'a, F> {
    packed: &'a PackedPath,
    frames: &'a F,
    params: &'a PtParams,
}

impl<F: Frames> Carried<'_, F> {
    /// Whether the frame of the origin is another one, and differs.
    #[inline(always)]
    fn is_carried(&self) -> bool {
        self.params.has(Flags::BACK) & self.params.has(Flags::CHANGED)
    }

    /// Its course, and the area there over the area here around its vertex k.
    #[inline(always)]
    fn course_and_extent(&self) -> (Path, f32) {
        let course = self.packed.course();
        if !self.is_carried() {
            return (course, 1.0);
        }
        let mut path = self.packed.unpack().path;
        let extent = carry(self.frames, self.params, false, &mut path);
        (Path { term: path.term, ..course }, extent)
    }
}

impl<F: Frames> KeptPath for Carried<'_, F> {
    #[inline(always)]
    fn course(&self) -> Path {
        self.course_and_extent().0
    }

    #[inline(always)]
    fn path(&self) -> Path {
        let mut path = self.packed.unpack().path;
        if self.is_carried() {
            carry(self.frames, self.params, false, &mut path);
        }
        path
    }
}

impl<F: Frames> Shift<F> for PackedPath {
    type Params = PtParams;
    type Origin = PathOrigin;

    #[inline(always)]
    fn shifted(&self, frames: &F, params: &PtParams, origin: &PathOrigin) -> Shifted {
        let (back, changed) = (params.has(Flags::BACK), params.has(Flags::CHANGED));
        let kept = Carried { packed: self, frames, params };
        let (Path { key, length, .. }, extent) = kept.course_and_extent();
        if origin.segments() + length > params.max_depth + 1 {
            return Shifted::failed(Cause::Unshiftable);
        }
        let numbers = PathNumbers::of_key(key, params.seed, params.flags.sampler());
        let shifted = shift::shift(&frames.scene(back), &numbers, &params.hybrid, origin, &kept, changed);
        Shifted { term: num::flush(shifted.term * extent), ..shifted }
    }
}
