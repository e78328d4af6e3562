//! Parameters of path tracing.

use crate::layout::{CameraParams, Extent, SceneHeader};
use crate::rng::Sampler;
use bytemuck::{Pod, Zeroable};

/// Path tracing flag: samples are spread uniformly over the pixel instead of going through its centre.
pub const PATH_JITTER: u32 = 1;
/// Path tracing flag: samples are spread about the pixel with the density of the Blackman-Harris filter.
pub const PATH_BLACKMAN_HARRIS: u32 = 4;
/// Path tracing flag: Russian roulette on the throughput from the fourth segment on.
pub const PATH_ROULETTE: u32 = 2;
/// Path tracing flag: numbers are drawn by [`Sampler::Sobol`].
pub const PATH_SOBOL: u32 = 8;

/// The longest paths that may be asked for: a closed scene that absorbs nothing never ends one.
pub const MAX_DEPTH: u32 = 1024;

/// Parameters of the kernel `path`: one aligned block of samples of every pixel. [`Self::new`] makes them; those of `default` are all zero,
/// an image without pixels, for what writes every field that counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PathParams {
    /// The scene's tables.
    pub scene: SceneHeader,
    /// The camera from which paths begin.
    pub camera: CameraParams,
    /// Image width in pixels, at most 16384.
    pub width: u32,
    /// Image height in pixels, at most 16384.
    pub height: u32,
    /// Index of the first sample, a multiple of `2^block_log2`.
    pub first_sample: u32,
    /// The block has `2^block_log2` samples; at most [`crate::film::MAX_BLOCK_LOG2`].
    pub block_log2: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Longest path, in segments, at most [`MAX_DEPTH`]: 1 is directly visible emission, 2 adds direct light.
    pub max_depth: u32,
    /// [`PATH_JITTER`] or [`PATH_BLACKMAN_HARRIS`], [`PATH_ROULETTE`] and [`PATH_SOBOL`].
    pub flags: u32,
    /// Zero.
    pub reserved: u32,
}

impl Extent for PathParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

impl PathParams {
    /// The first sample of every pixel, through its centre, of paths of up to 8 segments, with Sobol's numbers. The scene's tables are left
    /// out: a scene of other types has none, and one in arenas gives them by `scene`.
    pub fn new(camera: CameraParams, [width, height]: [u32; 2], seed: u32) -> Self {
        Self { camera, width, height, seed, max_depth: 8, flags: PATH_SOBOL, ..Self::default() }
    }

    /// The same in a kernel that was specialised to the flags in `bits`, or to none by a word without zeros.
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { flags: self.flags & bits, ..self }
    }

    /// How samples are spread.
    #[inline(always)]
    pub fn sampler(&self) -> Sampler {
        if self.flags & PATH_SOBOL != 0 { Sampler::Sobol } else { Sampler::Independent }
    }
}

const _: () = assert!(size_of::<PathParams>() == 176);
