//! Parameters of paths through media.

use crate::layout::Extent;
use crate::rng::Rng;
use crate::technique::path::PathParams;
use bytemuck::{Pod, Zeroable};
use core::ops::Deref;

/// The longest walks that may be asked for: random numbers are kept for so many.
pub const MAX_WALK: u32 = 65_535;

/// Parameters of the kernel `path_media`: one stretch of one sample of every pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MediaParams {
    /// As of path tracing: its block is the sample `first_sample` alone.
    pub path: PathParams,
    /// Not zero: paths begin. Zero: those that wait go on.
    pub begins: u32,
    /// Not zero: counting begins anew.
    pub counts_anew: u32,
    /// Segments inside of media after which a path waits.
    pub stretch: u32,
    /// Most segments of a path inside of media, at most [`MAX_WALK`]; then it ends.
    pub longest_walk: u32,
    /// Light counts that was scattered inside of media at least so often...
    pub least_order: u32,
    /// ... and at most so often.
    pub most_order: u32,
    /// Not zero: lights are sampled inside of media, too.
    pub lights_inside: u32,
    /// Not zero: a path that has left a medium ends with the next segment.
    pub ends_after_media: u32,
}

crate::fields!(MediaParams: path, begins, counts_anew, stretch, longest_walk, least_order, most_order, lights_inside, ends_after_media);

impl Extent for MediaParams {
    fn extent(&self) -> [u32; 2] {
        self.path.extent()
    }
}

/// What is asked of path tracing's parameters is asked of these, too: by kernels for instance, where the scene is.
impl Deref for MediaParams {
    type Target = PathParams;

    #[inline(always)]
    fn deref(&self) -> &PathParams {
        &self.path
    }
}

impl MediaParams {
    /// As [`PathParams::specialised`].
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { path: self.path.specialised(bits), ..self }
    }

    /// The random numbers of the pixel's sample.
    #[inline(always)]
    pub(super) fn rng(&self, [x, y]: [u32; 2]) -> Rng {
        Rng::new(x, y, self.path.first_sample, self.path.seed, self.path.sampler())
    }
}

const _: () = assert!(size_of::<MediaParams>() == 208);
