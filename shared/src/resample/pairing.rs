//! Random pairs of pixels: who shares with whom, mutually, and without a pattern.
//!
//! The image is cut into square tiles, at a place that the pass chooses, and in each tile a random permutation puts the pixels in a row,
//! where the first and the second one are a pair, the third and the fourth one, and so on. So a pixel finds its partner, and is that
//! one's partner, by going to its place in the row, to the one beside it, and back. The permutation is a Feistel network of three rounds.
//!
//! ```
//! use restir_shared::resample::pairing::Pairing;
//! use restir_shared::resample::reproject::Grid;
//! use restir_shared::rng::{Rng, Sampler};
//!
//! // tiles of 8 x 8 pixels
//! let grid = Grid { width: 32, height: 24 };
//! let pairing = Pairing { grid, tile: 3, rng: Rng::new(0, 0, 5, 7, Sampler::Independent), dimension: 0 };
//! let mut steps = std::collections::BTreeSet::new();
//! for at in (8..24).flat_map(|x| (8..16).map(move |y| [x, y])) {
//!     // away from the borders of the image all pixels have a partner, which is near, and is another one
//!     let partner = grid.at(pairing.partner(at));
//!     let step = [0, 1].map(|i| partner[i].abs_diff(at[i]));
//!     assert!(step[0] < 8 && step[1] < 8 && step != [0, 0]);
//!     assert_eq!(pairing.partner(partner), grid.index(at));
//!     steps.insert(step);
//! }
//! assert!(steps.len() > 16);
//! ```

use super::reproject::Grid;
use crate::rng::Rng;
use glam::UVec4;

/// The pairs of a pass.
#[derive(Clone, Copy, Debug)]
pub struct Pairing {
    /// The image.
    pub grid: Grid,
    /// The side of the tiles as a power of two: at least 1, at most 8.
    pub tile: u32,
    /// The random numbers of the frame.
    pub rng: Rng,
    /// The dimension in which these pairs are drawn.
    pub dimension: u32,
}

impl Pairing {
    /// The index of the pixel with which `at` is a pair; `u32::MAX` if it is none of the image.
    #[inline(always)]
    pub fn partner(&self, [x, y]: [u32; 2]) -> u32 {
        let mask = (1 << self.tile) - 1;
        let cut = self.rng.at(0xffff, 0xffff).hash(self.dimension);
        let (left, top) = (cut.x & mask, cut.y & mask);
        let (u, v) = (x + left, y + top);
        let words = self.rng.at(u >> self.tile, v >> self.tile).hash(self.dimension);
        let [dx, dy] = beside([u & mask, v & mask], words, mask);
        // below zero wraps to beyond any image
        let x = ((u & !mask) | dx).wrapping_sub(left);
        let y = ((v & !mask) | dy).wrapping_sub(top);
        if (x < self.grid.width) & (y < self.grid.height) { self.grid.index([x, y]) } else { u32::MAX }
    }
}

/// The place beside another one in the row of a tile's pixels.
#[inline(always)]
fn beside([x, y]: [u32; 2], words: UVec4, mask: u32) -> [u32; 2] {
    let x = x ^ (mix(y, words.x) & mask);
    let y = y ^ (mix(x, words.y) & mask);
    let x = x ^ (mix(y, words.z) & mask);
    // and back, from the other end of the pair
    let y = y ^ 1;
    let x = x ^ (mix(y, words.z) & mask);
    let y = y ^ (mix(x, words.y) & mask);
    [x ^ (mix(y, words.x) & mask), y]
}

/// Sixteen bits that depend on all of both words.
#[inline(always)]
fn mix(value: u32, key: u32) -> u32 {
    let word = (value ^ key).wrapping_mul(0x9e37_79b9);
    (word ^ (word >> 15)).wrapping_mul(0x85eb_ca6b) >> 16
}
