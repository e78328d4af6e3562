//! Choice among outcomes by an integer distribution function, exact and, unlike an alias table, invertible.

use super::to_unit;
#[cfg(not(target_arch = "spirv"))]
use crate::lanes::{LANES, Lanes};
use crate::num::{self, mul_wide};

/// The bound that stands for 2^32. No item with a probability begins there.
pub const CDF_END: u32 = u32::MAX;
const TWO_POW_16: f32 = 65_536.0;
const TWO_POW_M32: f32 = 1.0 / 4_294_967_296.0;
/// Biased exponent of a number whose mantissa is its fixed-point form with 32 binary places.
const FIXED_POINT: u32 = 118;

/// A chosen item.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The item.
    pub index: u32,
    /// Its probability, rounded to an `f32`.
    pub probability: f32,
    /// Position within the item, in (0, 1), of what the choice has left of the random word: uniform over the centres
    /// of as many equal parts as the item has words, so it has 32 bits less those of the choice, and at most 24. With so
    /// many bits it may serve as the next random number.
    pub fraction: f32,
}

/// Chooses one of `count` > 0 items by a random word.
///
/// Item i has the words from its lower bound `cdf(i)` up to the next item's, of 2^32 in all, so probabilities are exact.
/// Bounds do not decrease; items without probability share their bound with the next one and are never chosen. A bound
/// of [`CDF_END`] stands for 2^32: it is that of items without probability at the end.
#[inline(always)]
pub fn sample_discrete(word: u32, count: u32, cdf: impl Fn(u32) -> u32) -> Cell {
    discrete_cell(find_discrete(word, count, &cdf), word, count, cdf)
}

/// The item that [`sample_discrete`] chooses.
#[inline(always)]
pub fn find_discrete(word: u32, count: u32, cdf: impl Fn(u32) -> u32) -> u32 {
    let key = key(word);
    let mut index = 0;
    let mut end = count;
    while end.wrapping_sub(index) > 1 {
        let middle = index.wrapping_add(end.wrapping_sub(index) >> 1);
        if cdf(middle) <= key {
            index = middle;
        } else {
            end = middle;
        }
    }
    index
}

/// [`find_discrete`] in each lane, by SIMD: `cdf(lane, i)` bounds the items of a lane, and `parts(lane)` has the bound of every `part`th of
/// them, from the first on. These lie in a row, so that all are compared at once, and take little of a cache. `part` is a power of two.
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub fn find_discrete_each<'a>(
    words: &Lanes<u32>,
    count: u32,
    part: u32,
    parts: impl Fn(usize) -> &'a [u32],
    cdf: impl Fn(usize, u32) -> u32,
) -> Lanes<u32> {
    let mut found = Lanes::<u32>::ZERO;
    for lane in 0..LANES {
        let key = key(words.get(lane));
        // bounds do not decrease, so that those reached come before the others
        let reached: u32 = parts(lane).iter().map(|&bound| u32::from(bound <= key)).sum();
        found.set(lane, reached.saturating_sub(1) * part);
    }
    let mut step = part >> 1;
    while step > 0 {
        for lane in 0..LANES {
            let (here, next) = (found.get(lane), found.get(lane) + step);
            let is_reached = (next < count) & (cdf(lane, next.min(count.wrapping_sub(1))) <= key(words.get(lane)));
            found.set(lane, if is_reached { next } else { here });
        }
        step >>= 1;
    }
    found
}

/// What [`sample_discrete`] makes of an item, which is the one that it chooses.
#[inline(always)]
pub fn discrete_cell(index: u32, word: u32, count: u32, cdf: impl Fn(u32) -> u32) -> Cell {
    let item = bounds(index, count, &cdf);
    let size = wide(span(item), 1.0);
    let fraction = to_unit(num::div(wide(word.wrapping_sub(item.0), 0.5), size));
    Cell { index, probability: size * TWO_POW_M32, fraction }
}

/// What bounds are compared with: the last word belongs to the last item with a probability, not to those after it.
#[inline(always)]
fn key(word: u32) -> u32 {
    if word == CDF_END { CDF_END - 1 } else { word }
}

/// The probability of an item, rounded to an `f32`.
#[inline(always)]
pub fn discrete_probability(index: u32, count: u32, cdf: impl Fn(u32) -> u32) -> f32 {
    let item = bounds(index, count, &cdf);
    if item.0 == item.1 { 0.0 } else { wide(span(item), 1.0) * TWO_POW_M32 }
}

/// The word of which [`sample_discrete`] makes the item, which has a probability, and the fraction: exactly for items of
/// up to 2^23 words, beyond that to 2^-22 of the item.
#[inline(always)]
pub fn invert_discrete(index: u32, fraction: f32, count: u32, cdf: impl Fn(u32) -> u32) -> u32 {
    let item = bounds(index, count, &cdf);
    // floor(fraction (span + 1)), in integers: the size itself may be 2^32
    let fixed = fixed_point(to_unit(fraction));
    let (high, low) = mul_wide(fixed, span(item));
    let carry = if low > !fixed { 1 } else { 0 };
    item.0.wrapping_add(high).wrapping_add(carry)
}

/// The bounds of an item and of the next one.
#[inline(always)]
fn bounds(index: u32, count: u32, cdf: &impl Fn(u32) -> u32) -> (u32, u32) {
    let next = index.wrapping_add(1);
    (cdf(index), if next < count { cdf(next) } else { CDF_END })
}

/// The words between the bounds, less one: there may be 2^32.
#[inline(always)]
fn span((lower, upper): (u32, u32)) -> u32 {
    let last = if upper == CDF_END { CDF_END } else { upper.wrapping_sub(1) };
    last.wrapping_sub(lower)
}

/// `n + part`, rounded once, for a part in [0, 1].
#[inline(always)]
fn wide(n: u32, part: f32) -> f32 {
    (n >> 16) as f32 * TWO_POW_16 + ((n & 0xffff) as f32 + part)
}

/// floor(x 2^32) for x in [0, 1).
#[inline(always)]
fn fixed_point(x: f32) -> u32 {
    let bits = x.to_bits();
    let exponent = bits >> 23;
    let mantissa = (bits & 0x007f_ffff) | 0x0080_0000;
    if exponent >= FIXED_POINT {
        mantissa << exponent.wrapping_sub(FIXED_POINT)
    } else if exponent > FIXED_POINT - 24 {
        mantissa >> FIXED_POINT.wrapping_sub(exponent)
    } else {
        0
    }
}
