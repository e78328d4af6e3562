//! Parameters of path tracing.

use super::PathFlags;
use crate::layout::{CameraParams, Extent, SceneHeader};
use crate::rng::Sampler;
use bytemuck::{Pod, Zeroable};

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
    /// Width in pixels of what is traced, an image or a tile of it; at most 16384.
    pub width: u32,
    /// Its height in pixels, at most 16384.
    pub height: u32,
    /// Index of the first sample, a multiple of `2^block_log2`.
    pub first_sample: u32,
    /// The block has `2^block_log2` samples; at most [`crate::film::MAX_BLOCK_LOG2`].
    pub block_log2: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Longest path, in segments, at most [`MAX_DEPTH`]: 1 is directly visible emission, 2 adds direct light.
    pub max_depth: u32,
    /// What it does.
    pub flags: PathFlags,
    /// Where in the image a tile has its upper left corner: the column, and the row times 2^16. Zero of a whole image.
    pub corner: u32,
}

crate::fields!(PathParams: scene, camera, width, height, first_sample, block_log2, seed, max_depth, flags, corner);

impl Extent for PathParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

impl PathParams {
    /// The first sample of every pixel, through its centre, of paths of up to 8 segments, with Sobol's numbers. The scene's tables are left
    /// out: a scene of other types has none, and one in arenas gives them by `scene`.
    pub fn new(camera: CameraParams, [width, height]: [u32; 2], seed: u32) -> Self {
        Self { camera, width, height, seed, max_depth: 8, flags: PathFlags::SOBOL, ..Self::default() }
    }

    /// The same in a kernel that was specialised to the flags in `bits`, or to none by a word without zeros.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { flags: self.flags.specialised(bits), ..self }
    }

    /// The same in a kernel that was specialised to blocks of one sample by 0, or to none by a word without zeros.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn in_blocks(self, bits: u32) -> Self {
        Self { block_log2: self.block_log2 & bits, ..self }
    }

    /// The pixel of the image that is the tile's pixel (x, y).
    #[inline(always)]
    pub fn in_image(&self, [x, y]: [u32; 2]) -> [u32; 2] {
        [x.wrapping_add(self.corner & 0xffff), y.wrapping_add(self.corner >> 16)]
    }

    /// How many rays the samples of a block ask for at most: along each segment, and from each vertex but the last one to a light.
    #[doc(hidden)]
    #[cfg(not(target_arch = "spirv"))]
    pub fn most_rays(&self) -> u32 {
        (2 * self.max_depth).saturating_sub(1) << self.block_log2
    }

    /// How samples are spread.
    #[inline(always)]
    pub fn sampler(&self) -> Sampler {
        if self.flags.contains(PathFlags::SOBOL) { Sampler::Sobol } else { Sampler::Independent }
    }
}

const _: () = assert!(size_of::<PathParams>() == 176);
