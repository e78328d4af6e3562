//! The film sums samples pairwise by sample index: a binary tree over the index, whose shape depends on nothing
//! else. However samples are split over dispatches, threads or machines, aligned blocks of 2^k samples have the
//! same bits, and so has their merger.
//!
//! ```
//! use restir_shared::film::{CUT, sum_block};
//! use restir_shared::glam::Vec3;
//!
//! // some sample of a pixel, as a function of its index
//! let sample = |index: u32| Vec3::new(1.0, 2.0, 4.0) / (index + 3) as f32;
//!
//! // eight samples at once have the same bits as two blocks of four that are merged
//! let whole = sum_block(0, 3, sample);
//! assert_eq!(whole, sum_block(0, 2, sample).merge(sum_block(4, 2, sample)));
//! let sum = (0..8).map(sample).sum::<Vec3>();
//! assert!((Vec3::from_array(whole.sum) - sum).length() < 1e-5);
//!
//! // what is no radiance is counted, not added
//! assert_eq!(sum_block(0, 1, |index| if index == 0 { CUT } else { Vec3::ONE }).dropped, 1.0);
//! ```

use crate::layout::FilmPixel;
use crate::num;
use glam::Vec3;

/// The largest block that one invocation sums, as a power of two.
pub const MAX_BLOCK_LOG2: u32 = 6;
/// The radiance from which on a sample is dropped: 2^100.
const MAX_RADIANCE: f32 = 1.267_650_6e30;

/// The radiance of a sample that a device which limits loops has cut short: beyond what the film accepts, so that it
/// is dropped and counted.
pub const CUT: Vec3 = Vec3::splat(f32::MAX);

const LEVELS: usize = MAX_BLOCK_LOG2 as usize + 1;

impl FilmPixel {
    /// One sample. A radiance that is no number or not below 2^100 is counted instead of added, and magnitudes below
    /// 2^-100 are zero, so that a device that flushes subnormals gives the same sum.
    #[inline(always)]
    pub fn from_radiance(radiance: Vec3) -> Self {
        let [x, y, z] = [num::abs(radiance.x), num::abs(radiance.y), num::abs(radiance.z)];
        let finite = (x < MAX_RADIANCE) & (y < MAX_RADIANCE) & (z < MAX_RADIANCE);
        if finite {
            Self { sum: [num::flush(radiance.x), num::flush(radiance.y), num::flush(radiance.z)], dropped: 0.0 }
        } else {
            Self { sum: [0.0, 0.0, 0.0], dropped: 1.0 }
        }
    }

    /// The sum of two blocks.
    #[inline(always)]
    pub fn merge(self, other: Self) -> Self {
        Self {
            sum: [self.sum[0] + other.sum[0], self.sum[1] + other.sum[1], self.sum[2] + other.sum[2]],
            dropped: self.dropped + other.dropped,
        }
    }

    /// The mean of so many samples, of their sum; what was dropped stays a sum.
    #[inline(always)]
    #[must_use]
    pub fn mean(self, samples: f32) -> Self {
        let mean_of = |x| num::flush(num::div(x, samples));
        Self { sum: [mean_of(self.sum[0]), mean_of(self.sum[1]), mean_of(self.sum[2])], dropped: self.dropped }
    }
}

/// The sum over the block of 2^`block_log2` samples that begins at `first`, a multiple of its size.
///
/// Block sizes beyond [`MAX_BLOCK_LOG2`] are reduced to it.
#[inline(always)]
pub fn sum_block(first: u32, block_log2: u32, mut sample: impl FnMut(u32) -> Vec3) -> FilmPixel {
    let log2 = if block_log2 < MAX_BLOCK_LOG2 { block_log2 } else { MAX_BLOCK_LOG2 };
    let count = 1 << log2;
    // partial[l] holds the sum of a finished block of 2^l samples that waits for its neighbour
    let mut partial = [FilmPixel { sum: [0.0, 0.0, 0.0], dropped: 0.0 }; LEVELS];
    // with the last sample that of the whole block
    let mut sum = partial[0];
    let mut i = 0;
    // Counted beside `i`, of which a compiler knows the value after the loop. The last round, without a sample, is
    // reached only by an invocation whose loops were not cut.
    let mut rounds = 0_u32;
    while i <= count {
        if i < count {
            sum = FilmPixel::from_radiance(sample(first.wrapping_add(i)));
            // of a single sample, where a compiler knows that, there are no partial sums, which take registers
            if log2 > 0 {
                let mut level = 0;
                while (i >> level) & 1 == 1 {
                    sum = partial[level as usize].merge(sum);
                    level += 1;
                }
                partial[level as usize] = sum;
            }
        }
        i += 1;
        rounds = rounds.wrapping_add(1);
    }
    if rounds <= count {
        // a driver that limits loops has cut this one: nothing of the block can be trusted
        return FilmPixel { sum: [0.0, 0.0, 0.0], dropped: count as f32 };
    }
    sum
}
