//! Sobol's sequence in four dimensions, with the direction numbers of Joe and Kuo (2008).
//!
//! Digits are counted from the lowest bit: bit 0 of a coordinate is its first digit, of weight 1/2. Coordinate 0 is then the index
//! itself, and each other one a linear map of it that carries digits downwards alone.
//!
//! The maps need neither tables nor loops over digits. The direction numbers v_j of a coordinate obey `p(X) v = S^e v`, where X
//! takes v_j to v_(j+1), S shifts by a digit, and p is the coordinate's primitive polynomial, of degree e. Squaring k times gives
//! `p(X^(2^k)) = S^(e 2^k)`, by which the upper half of each stretch of `e 2^(k+1)` digits turns into digits of its lower half, in all
//! stretches at once. What is left after the last level are the first e direction numbers, in each stretch of e digits.

use glam::UVec4;

/// The bits `from..to` of every stretch of `period` bits.
const fn places(period: u32, from: u32, to: u32) -> u32 {
    let mut bits = 0;
    let mut place = 0;
    while place < u32::BITS {
        if place % period >= from && place % period < to {
            bits |= 1 << place;
        }
        place += 1;
    }
    bits
}

/// The point of an index. Of every 2^m indices that differ in their lowest m bits alone, coordinates 0 and 1 are a (0, m, 2)-net in
/// base 2, coordinates 0 to 2 a (1, m, 3)-net, and all of them a (3, m, 4)-net.
#[inline(always)]
pub fn sobol(index: u32) -> UVec4 {
    UVec4::new(index, second(index), third(index), fourth(index))
}

/// The coordinate of X + 1: Pascal's triangle modulo 2.
#[inline(always)]
fn second(index: u32) -> u32 {
    let y = index ^ (index >> 16);
    let y = y ^ ((y & const { places(16, 8, 16) }) >> 8);
    let y = y ^ ((y & const { places(8, 4, 8) }) >> 4);
    let y = y ^ ((y & const { places(4, 2, 4) }) >> 2);
    y ^ ((y & const { places(2, 1, 2) }) >> 1)
}

/// The coordinate of X^2 + X + 1, with the direction numbers 1 and 3.
#[inline(always)]
fn third(index: u32) -> u32 {
    let y = quadratic::<1>(quadratic::<2>(quadratic::<4>(quadratic::<8>(index))));
    y ^ ((y & const { places(2, 1, 2) }) >> 1)
}

/// A level: `X^2Q = X^Q + 1 + S^2Q`.
#[inline(always)]
fn quadratic<const Q: u32>(y: u32) -> u32 {
    let y = y ^ ((y & const { places(4 * Q, 3 * Q, 4 * Q) }) >> Q);
    y ^ ((y & const { places(4 * Q, 2 * Q, 4 * Q) }) >> (2 * Q)) ^ ((y & const { places(4 * Q, 2 * Q, 3 * Q) }) >> Q)
}

/// The coordinate of X^3 + X + 1, with the direction numbers 1, 3 and 1.
#[inline(always)]
fn fourth(index: u32) -> u32 {
    let y = cubic::<1>(cubic::<2>(cubic::<4>(cubic::<8>(index))));
    y ^ ((y & const { places(3, 1, 2) }) >> 1)
}

/// A level: `X^3Q = X^Q + 1 + S^3Q`.
#[inline(always)]
fn cubic<const Q: u32>(y: u32) -> u32 {
    let y = y ^ ((y & const { places(6 * Q, 5 * Q, 6 * Q) }) >> (2 * Q));
    y ^ ((y & const { places(6 * Q, 3 * Q, 6 * Q) }) >> (3 * Q))
        ^ ((y & const { places(6 * Q, 3 * Q, 5 * Q) }) >> (2 * Q))
}
