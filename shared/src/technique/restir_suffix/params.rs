//! Parameters of the kernels of suffix ReSTIR.

use super::{Asks, EndRule};
use crate::layout::{CameraParams, Extent};
use crate::rng::Rng;
use crate::technique::restir_pt::PtParams;
use bytemuck::{Pod, Zeroable};
use core::ops::{Deref, DerefMut};

/// Parameters of a pass. Those of `default` are all zero, an image without pixels, for what writes every field that counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SuffixParams {
    /// Those of the passes that trace and shift suffixes.
    pub path: PtParams,
    /// Where prefixes end.
    pub ends: EndRule,
    /// Integration prefixes of a pixel.
    pub prefixes: u32,
    /// Which of them this pass is about.
    pub prefix: u32,
    /// Suffixes that an integration prefix borrows.
    pub borrowed: u32,
    /// Supporting prefixes are looked for within so many pixels' footprints around the end of an integration prefix.
    pub radius: f32,
    /// Frames for which a supporting prefix is kept in the mean; with 1 or less none is.
    pub kept_for: f32,
    /// Buckets of the grid of prefixes, a power of two.
    pub buckets: u32,
    /// Which shifts a pass asks for.
    pub asks: Asks,
    /// The weight of a canonical suffix: one over the number of a pixel's integration prefixes that have one, which stand for the others, too.
    pub canonical_share: f32,
}

crate::fields!(SuffixParams: path, ends, prefixes, prefix, borrowed, radius, kept_for, buckets, asks, canonical_share);

impl Deref for SuffixParams {
    type Target = PtParams;

    #[inline(always)]
    fn deref(&self) -> &PtParams {
        &self.path
    }
}

impl DerefMut for SuffixParams {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut PtParams {
        &mut self.path
    }
}

impl Extent for SuffixParams {
    fn extent(&self) -> [u32; 2] {
        self.path.extent()
    }
}

/// Seeds differ by these, so that what is drawn is independent.
const SUPPORTING: u32 = 0x5350_0000;
const INTEGRATION: u32 = 0x4950_0000;
const CANONICAL: u32 = 0x4353_0000;

impl SuffixParams {
    /// Parameters of a frame, with the defaults of the program. Their grid has as many buckets as [`sort`](crate::compact) by three digits of 6 bits has.
    pub fn new(camera: CameraParams, size: [u32; 2], seed: u32) -> Self {
        let mut path = PtParams::new(camera, size, seed);
        (path.neighbours, path.confidence_cap) = (1, 50.0);
        Self {
            path,
            ends: EndRule { min_segments: 2, min_roughness: 0.2, min_distance: 0.01 },
            prefixes: 4,
            prefix: 0,
            borrowed: 2,
            radius: 4.0,
            kept_for: 50.0,
            buckets: 1 << 18,
            asks: Asks::BORROWED,
            canonical_share: 1.0,
        }
    }

    /// The random numbers of a pixel's supporting prefix.
    #[inline(always)]
    pub fn supporting(&self, [x, y]: [u32; 2]) -> Rng {
        Rng::new(x, y, self.frame, self.seed ^ SUPPORTING, self.flags.sampler())
    }

    /// The random numbers of a pixel's integration prefix: those of all frames are samples of one sequence, so that Sobol's spreads them.
    #[inline(always)]
    pub fn integration(&self, [x, y]: [u32; 2]) -> Rng {
        Rng::new(x, y, self.sample(), self.seed ^ INTEGRATION, self.flags.sampler())
    }

    /// See [`PtParams::specialised`].
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { path: self.path.specialised(bits), ..self }
    }

    fn sample(&self) -> u32 {
        self.frame.wrapping_mul(self.prefixes).wrapping_add(self.prefix)
    }

    /// For tests: the seed by which an integration prefix is drawn whose canonical suffix is drawn by this one.
    #[doc(hidden)]
    pub fn seed_of_prefix(seed: u32) -> u32 {
        seed ^ CANONICAL ^ INTEGRATION
    }

    /// The parameters of passes over canonical suffixes.
    #[must_use]
    pub fn canonical(&self) -> PtParams {
        let mut params = self.path;
        params.seed ^= CANONICAL;
        params.frame = self.sample();
        params
    }
}
