//! The corrections of [`restir_shared::num::soft`] for every error that their seed may have.

use super::sweep::sweep;
use super::{Effort, Row, Tally, exact};
use crate::random::SplitMix;
use restir_shared::num::soft::{self, SEED_SLACK};

const HIDDEN: u32 = 1 << 23;
/// Random pairs of mantissas.
const PAIRS: u64 = 100_000_000;
/// Units of the 25-bit result in one of the last place of an `f32`.
const UNITS_PER_ULP: u32 = 2;
const REDUCED_STRIDE: u64 = 257;
/// `y` itself and off by its 16 bits to both sides.
const ESTIMATES: [f64; 3] = [1.0, 1.0 + 1.0 / 65_536.0, 1.0 - 1.0 / 65_536.0];

/// Every seed and every estimate for one true floor; `correction(seed, y)` must give the floor.
fn visit(operands: u64, floor: u32, y: f64, correction: impl Fn(u32, f32) -> u32, tally: &mut Tally) {
    for seed in floor - SEED_SLACK..=floor + SEED_SLACK {
        for factor in ESTIMATES {
            tally.check(operands, correction(seed, (y * factor) as f32) == floor);
        }
    }
}

/// Every seed that is off by whole units in the last place of an `f32`, and `y` rounded once.
fn visit_ulps(operands: u64, floor: u32, y: f64, correction: impl Fn(u32, f32) -> u32, tally: &mut Tally) {
    for seed in (floor - SEED_SLACK..=floor + SEED_SLACK).step_by(UNITS_PER_ULP as usize) {
        tally.check(operands, correction(seed, y as f32) == floor);
    }
}

/// A correction of one operand over the mantissas in `[2^23, end)`.
fn unary(
    effort: Effort,
    end: u32,
    correction: impl Fn(u32, u32, f32) -> u32 + Sync,
    floor: impl Fn(u32) -> u32 + Sync,
    y: impl Fn(u32) -> f64 + Sync,
) -> Tally {
    let stride = effort.stride(REDUCED_STRIDE);
    sweep(u64::from(end - HIDDEN).div_ceil(stride), 0.0, |i, tally| {
        let m = HIDDEN + (i * stride) as u32;
        // above 2^24 a mantissa is a doubled one of 24 bits
        let m = if m >= 2 * HIDDEN { m & !1 } else { m };
        visit(u64::from(m), floor(m), y(m), |seed, y| correction(m, seed, y), tally);
    })
}

/// The `i`-th pair: half of them are close to each other or to the ends of the range.
fn pair(i: u64) -> [u32; 2] {
    let word = SplitMix::new(i).word();
    let (a, b) = (word as u32 & (HIDDEN - 1), (word >> 40) as u32 & (HIDDEN - 1));
    let near = (word >> 32) as u32 & 31;
    let (a, b) = match i % 4 {
        0 | 1 => (a, b),
        2 => (a, a.wrapping_add(near).wrapping_sub(16) & (HIDDEN - 1)),
        _ => (a, near.wrapping_sub(16) & (HIDDEN - 1)),
    };
    [a | HIDDEN, b | HIDDEN]
}

/// A pair as the tally names it, its quotient's floor, and 2^23 / b.
fn quotient([a, b]: [u32; 2]) -> (u64, u32, f64) {
    let y = f64::from(HIDDEN) / f64::from(b);
    (u64::from(a) << 32 | u64::from(b), exact::div_floor(a, b), y)
}

/// Division of random pairs of mantissas.
pub fn division(effort: Effort, correction: impl Fn(u32, u32, u32, f32) -> u32 + Sync) -> Tally {
    sweep(PAIRS / effort.stride(REDUCED_STRIDE), 0.0, |i, tally| {
        let [a, b] = pair(i);
        let (operands, floor, y) = quotient([a, b]);
        visit_ulps(operands, floor, y, |seed, y| correction(a, b, seed, y), tally);
    })
}

/// Mantissas at which carries, borrows and powers of two meet: the ends of the range, one bit set, all bits set above or
/// below a place, alternating bits, and their neighbours.
fn boundary() -> Vec<u32> {
    let mut mantissas: Vec<u32> = (0..23)
        .flat_map(|bit| [1 << bit, (1 << bit) - 1, HIDDEN - (1 << bit)])
        .chain([0x0055_5555, 0x002a_aaaa])
        .flat_map(|low: u32| [low.wrapping_sub(1), low, low + 1])
        .map(|low| low & (HIDDEN - 1) | HIDDEN)
        .collect();
    mantissas.sort_unstable();
    mantissas.dedup();
    mantissas
}

/// Division of all pairs of the boundary mantissas.
pub fn division_at_boundaries(correction: impl Fn(u32, u32, u32, f32) -> u32 + Sync) -> Tally {
    let boundary = boundary();
    let count = boundary.len();
    sweep((count * count) as u64, 0.0, |i, tally| {
        let [a, b] = [boundary[i as usize / count], boundary[i as usize % count]];
        let (operands, floor, y) = quotient([a, b]);
        visit(operands, floor, y, |seed, y| correction(a, b, seed, y), tally);
    })
}

/// Reciprocals of mantissas.
pub fn reciprocal(effort: Effort, correction: impl Fn(u32, u32, f32) -> u32 + Sync) -> Tally {
    unary(effort, 2 * HIDDEN, correction, exact::recip_floor, |m| f64::from(HIDDEN) / f64::from(m))
}

/// Square roots of mantissas.
pub fn square_root(effort: Effort, correction: impl Fn(u32, u32, f32) -> u32 + Sync) -> Tally {
    unary(effort, 4 * HIDDEN, correction, exact::sqrt_floor, inverse_root)
}

/// Reciprocal square roots of mantissas.
pub fn reciprocal_root(effort: Effort, correction: impl Fn(u32, u32, f32) -> u32 + Sync) -> Tally {
    // only of 1 is it a whole number
    let below = |m| exact::rsqrt_floor(m) - u32::from(m == HIDDEN);
    unary(effort, 4 * HIDDEN, correction, below, inverse_root)
}

/// 1 / sqrt(m 2^-23).
fn inverse_root(m: u32) -> f64 {
    (f64::from(HIDDEN) / f64::from(m)).sqrt()
}

/// The table's rows.
pub(super) fn rows(effort: Effort) -> Vec<Row> {
    let row = |function, domain, tally| Row::rounding(function, "correction", domain, tally);
    let all = "seeds within ±16 units, `y` to 16 bits";
    let boundaries = "boundary pairs, seeds within ±16 units, `y` to 16 bits";
    vec![
        row("div", "10⁸ pairs, seeds within ±8 ulp, `y` to 24 bits", division(effort, soft::div_mantissa)),
        row("div", boundaries, division_at_boundaries(soft::div_mantissa)),
        row("recip", all, reciprocal(effort, soft::recip_mantissa)),
        row("sqrt", all, square_root(effort, soft::sqrt_mantissa)),
        row("rsqrt", all, reciprocal_root(effort, soft::rsqrt_mantissa)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_boundary_has_the_ends_of_the_range_and_their_neighbours() {
        let boundary = boundary();
        assert!(boundary.len() >= 64);
        for m in [HIDDEN, HIDDEN + 1, 2 * HIDDEN - 2, 2 * HIDDEN - 1] {
            assert!(boundary.contains(&m), "{m:#x}");
        }
        assert!(boundary.iter().all(|m| (HIDDEN..2 * HIDDEN).contains(m)));
    }
}
