//! What the checks share.

use glam::{UVec4, Vec2};
use restir_shared::rng::{self, pcg4d};

/// Samples of a test.
pub(crate) const DRAWS: u64 = 1 << 20;
/// Half the distance between 1 and its neighbour, the error of one rounding.
pub(crate) const ROUNDING: f64 = 1.0 / 16_777_216.0;

/// Random words for the samplers.
pub(crate) fn words(i: u64, stream: u32) -> [u32; 4] {
    pcg4d(UVec4::new(i as u32, stream, 11, 13)).to_array()
}

/// Two of them.
pub(crate) fn two_words(i: u64, stream: u32) -> [u32; 2] {
    let [a, b, ..] = words(i, stream);
    [a, b]
}

/// Uniform numbers for the samplers.
pub(crate) fn numbers(i: u64, stream: u32) -> Vec2 {
    two_words(i, stream).map(rng::unit).into()
}
