//! Parameters of the kernels of ReSTIR PT, and elements of their planes.

use crate::layout::{Extent, SceneHeader};
use crate::rng::Sampler;
use crate::shift::Hybrid;
use bytemuck::{Pod, Zeroable};

/// Flag: numbers are drawn by [`Sampler::Sobol`].
pub const PT_SOBOL: u32 = 1;

/// Parameters of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PtParams {
    /// The scene's tables.
    pub scene: SceneHeader,
    /// Where paths are joined.
    pub hybrid: Hybrid,
    /// Width of the grid of jobs, or of the image.
    pub width: u32,
    /// Height.
    pub height: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// [`PT_SOBOL`].
    pub flags: u32,
    /// Zero.
    pub reserved: [u32; 3],
}

const _: () = assert!(size_of::<PtParams>() == 128);

impl Extent for PtParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

impl PtParams {
    /// How the numbers of a path are spread.
    #[inline(always)]
    pub fn sampler(&self) -> Sampler {
        if self.flags & PT_SOBOL != 0 { Sampler::Sobol } else { Sampler::Independent }
    }
}

/// A path that is to be shifted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Job {
    /// The index of the path in its plane.
    pub path: u32,
    /// The index of the start that it is taken to.
    pub start: u32,
}

impl Job {
    /// Nothing to do.
    pub const NONE: Self = Self { path: u32::MAX, start: 0 };
}

/// What became of a job, in 16 bytes: zeros if the path cannot be shifted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct JobShifted {
    /// The integrand at the start, linear RGB.
    pub value: [f32; 3],
    /// See [`Path::term`](crate::shift::Path::term); over that of the path it is the Jacobian.
    pub term: f32,
}
