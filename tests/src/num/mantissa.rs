//! The corrections of [`restir_shared::num::soft`] for every error that their seed may have.

use super::sweep::sweep;
use super::{Effort, Row, Tally, exact};
use crate::random::SplitMix;
use restir_shared::num::soft::{self, SEED_SLACK};

const HIDDEN: u32 = 1 << 23;
const PAIRS: u64 = 4_000_000;
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

/// A correction of one operand over the mantissas in `[2^23, end)`.
fn unary(
    effort: Effort,
    end: u32,
    correction: impl Fn(u32, u32, f32) -> u32 + Sync,
    floor: impl Fn(u32) -> u32 + Sync,
    y: impl Fn(u32) -> f64 + Sync,
) -> Tally {
    let stride = effort.stride(REDUCED_STRIDE);
    let [tally] = sweep(u64::from(end - HIDDEN).div_ceil(stride), 0.0, |i, [tally]| {
        let m = HIDDEN + (i * stride) as u32;
        // above 2^24 a mantissa is a doubled one of 24 bits
        let m = if m >= 2 * HIDDEN { m & !1 } else { m };
        visit(u64::from(m), floor(m), y(m), |seed, y| correction(m, seed, y), tally);
    });
    tally
}

/// Division of mantissas: random pairs, half of them close to each other or to the ends of the range.
pub fn division(effort: Effort, correction: impl Fn(u32, u32, u32, f32) -> u32 + Sync) -> Tally {
    let [tally] = sweep(PAIRS / effort.stride(REDUCED_STRIDE), 0.0, |i, [tally]| {
        let word = SplitMix::new(i).word();
        let (a, b) = (word as u32 & (HIDDEN - 1), (word >> 40) as u32 & (HIDDEN - 1));
        let near = (word >> 32) as u32 & 31;
        let (a, b) = match i % 4 {
            0 | 1 => (a, b),
            2 => (a, a.wrapping_add(near).wrapping_sub(16) & (HIDDEN - 1)),
            _ => (a, near.wrapping_sub(16) & (HIDDEN - 1)),
        };
        let (a, b) = (a | HIDDEN, b | HIDDEN);
        let y = f64::from(HIDDEN) / f64::from(b);
        let operands = u64::from(a) << 32 | u64::from(b);
        visit(
            operands,
            exact::div_floor(a, b),
            y,
            |seed, y| correction(a, b, seed, y),
            tally,
        );
    });
    tally
}

/// Reciprocals of mantissas.
pub fn reciprocal(effort: Effort, correction: impl Fn(u32, u32, f32) -> u32 + Sync) -> Tally {
    unary(effort, 2 * HIDDEN, correction, exact::recip_floor, |m| {
        f64::from(HIDDEN) / f64::from(m)
    })
}

/// Square roots of mantissas.
pub fn square_root(effort: Effort, correction: impl Fn(u32, u32, f32) -> u32 + Sync) -> Tally {
    unary(effort, 4 * HIDDEN, correction, exact::sqrt_floor, inverse_root)
}

/// Reciprocal square roots of mantissas.
pub fn reciprocal_root(effort: Effort, correction: impl Fn(u32, u32, f32) -> u32 + Sync) -> Tally {
    unary(effort, 4 * HIDDEN, correction, exact::rsqrt_floor, inverse_root)
}

/// 1 / sqrt(m 2^-23).
fn inverse_root(m: u32) -> f64 {
    (f64::from(HIDDEN) / f64::from(m)).sqrt()
}

/// The table's rows.
pub(super) fn rows(effort: Effort) -> Vec<Row> {
    let form = "correction";
    let domain = "seeds within ±16 units, `y` to 16 bits";
    vec![
        Row::rounding("div", form, domain, division(effort, soft::div_mantissa)),
        Row::rounding("recip", form, domain, reciprocal(effort, soft::recip_mantissa)),
        Row::rounding("sqrt", form, domain, square_root(effort, soft::sqrt_mantissa)),
        Row::rounding("rsqrt", form, domain, reciprocal_root(effort, soft::rsqrt_mantissa)),
    ]
}
