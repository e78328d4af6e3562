//! The elementary functions against `f64`, whose own error is below a thousandth of the unit used here.

use super::sweep::sweep;
use super::{Effort, MAX_ULP, Row, Tally};
use crate::random::SplitMix;
use restir_shared::num::{self, EXP_MAX, EXP_MIN, TURNS_MAX};
use std::f64::consts::TAU;

const PAIRS: u64 = 200_000_000;
const REDUCED_STRIDE: u64 = 4_099;
/// Angles below this are outside the contract: their terms are subnormal.
const SMALLEST_ANGLE: f64 = num::FLUSH_BELOW as f64;
/// The operands of `atan2` have biased exponents in this range: sums and quotients stay normal numbers.
const ATAN_EXPONENTS: std::ops::Range<u32> = 28..228;

/// The distance between neighbours of `x` among the `f32` of its binade; that of the smallest normal numbers below.
pub fn ulp(x: f64) -> f64 {
    let exponent = ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    f64::exp2(f64::from(exponent.max(-126) - 23))
}

/// |computed - exact| in units in the last place; where the exact value is zero nothing else is right.
pub fn error(computed: f32, exact: f64) -> f64 {
    if exact == 0.0 {
        return if computed == 0.0 { 0.0 } else { f64::INFINITY };
    }
    (f64::from(computed) - exact).abs() / ulp(exact)
}

/// Bit patterns from `first` to `last`.
#[derive(Clone, Copy)]
struct Run {
    first: u32,
    last: u32,
}

impl Run {
    /// The numbers between two of the same sign.
    fn between(a: f32, b: f32) -> Self {
        let (a, b) = (a.to_bits(), b.to_bits());
        Self { first: a.min(b), last: a.max(b) }
    }

    /// Every `stride`-th number, and the last.
    fn sweep<const N: usize>(self, stride: u64, visit: impl Fn(f32, &mut [Tally; N]) + Sync) -> [Tally; N] {
        let length = u64::from(self.last - self.first);
        sweep(length.div_ceil(stride) + 1, MAX_ULP, |i, tallies| {
            let step = (i * stride).min(length) as u32;
            visit(f32::from_bits(self.first + step), tallies);
        })
    }
}

/// The numbers of both runs.
fn both<const N: usize>(effort: Effort, runs: [Run; 2], visit: impl Fn(f32, &mut [Tally; N]) + Sync) -> [Tally; N] {
    let stride = effort.stride(REDUCED_STRIDE);
    let [a, b] = runs.map(|run| run.sweep(stride, &visit));
    std::array::from_fn(|i| a[i].merge(b[i]))
}

/// The exponential over its whole domain.
pub fn exponential(effort: Effort, function: impl Fn(f32) -> f32 + Sync) -> Tally {
    let runs = [Run::between(0.0, EXP_MAX), Run::between(-0.0, EXP_MIN)];
    let [tally] = both(effort, runs, |x, [tally]| {
        tally.record(u64::from(x.to_bits()), error(function(x), f64::from(x).exp()));
    });
    tally
}

/// The logarithm over all positive normal numbers.
pub fn logarithm(effort: Effort, function: impl Fn(f32) -> f32 + Sync) -> Tally {
    let run = Run::between(f32::MIN_POSITIVE, f32::MAX);
    let [tally] = run.sweep(effort.stride(REDUCED_STRIDE), |x, [tally]| {
        tally.record(u64::from(x.to_bits()), error(function(x), f64::from(x).ln()));
    });
    tally
}

/// (sin, cos) of 2 pi u; the reduction is exact.
fn exact_sin_cos(u: f32) -> (f64, f64) {
    let u = f64::from(u);
    let quarters = (4.0 * u).round();
    let (sin, cos) = ((u - 0.25 * quarters) * TAU).sin_cos();
    match (quarters as i64).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Sine and cosine over all angles up to [`TURNS_MAX`] of normal magnitude.
pub fn sine_cosine(effort: Effort, function: impl Fn(f32) -> (f32, f32) + Sync) -> [Tally; 2] {
    let runs = [Run::between(f32::MIN_POSITIVE, TURNS_MAX), Run::between(-f32::MIN_POSITIVE, -TURNS_MAX)];
    both(effort, runs, |u, [sin, cos]| {
        let input = u64::from(u.to_bits());
        let (s, c) = function(u);
        let (exact_sin, exact_cos) = exact_sin_cos(u);
        sin.record(input, error(s, exact_sin));
        cos.record(input, error(c, exact_cos));
    })
}

/// The angle of random vectors, of vectors close to the octants' borders and of the axes.
pub fn angle(effort: Effort, function: impl Fn(f32, f32) -> f32 + Sync) -> Tally {
    let visit = |y: f32, x: f32, tally: &mut Tally| {
        // a zero of either sign is the same zero
        let exact = (f64::from(y) + 0.0).atan2(f64::from(x) + 0.0) / TAU;
        if exact == 0.0 || exact.abs() >= SMALLEST_ANGLE {
            let input = u64::from(y.to_bits()) << 32 | u64::from(x.to_bits());
            tally.record(input, error(function(y, x), exact));
        }
    };
    let [tally] = sweep(PAIRS / effort.stride(REDUCED_STRIDE), MAX_ULP, |i, [tally]| {
        if i == 0 {
            let axes = [0.0, -0.0, 1.0, -1.0, 3.0e-20, -3.0e20];
            axes.iter().for_each(|&y| axes.iter().for_each(|&x| visit(y, x, tally)));
        }
        let (y, x) = random_vector(i);
        visit(y, x, tally);
    });
    tally
}

/// A quarter has exponents all over the range, the others have them close to each other; of those two thirds lie
/// within 32 units in the last place of the slopes 1 and 1/2 where the form changes.
fn random_vector(index: u64) -> (f32, f32) {
    let mut random = SplitMix::new(index);
    let word = random.word();
    let (a, b) = (word as u32, (word >> 32) as u32);
    let with_exponent = |bits: u32, e: u32| f32::from_bits((bits & 0x807f_ffff) | (e << 23));
    let span = ATAN_EXPONENTS.len();
    let any = |bits: u32, random: &mut SplitMix| with_exponent(bits, ATAN_EXPONENTS.start + random.below(span) as u32);
    let x = with_exponent(a, 120 + (a >> 23 & 15));
    let beside = |y: f32| f32::from_bits(y.to_bits().wrapping_add(b & 63).wrapping_sub(32) ^ (b & 1 << 31));
    match index % 4 {
        0 => (any(b, &mut random), any(a, &mut random)),
        1 => (with_exponent(b, 120 + (b >> 23 & 15)), x),
        2 => (beside(x), x),
        _ if b & 64 == 0 => (beside(x * 0.5), x),
        _ => (x, beside(x * 0.5)),
    }
}

/// The table's rows.
pub(super) fn rows(effort: Effort) -> Vec<Row> {
    let [sin, cos] = sine_cosine(effort, num::sin_cos);
    let turns = "angles up to 2^20 turns";
    vec![
        Row::accuracy("exp", "from -87.33 to 88.72283", exponential(effort, num::exp)),
        Row::accuracy("ln", "positive normal numbers", logarithm(effort, num::ln)),
        Row::accuracy("sin", turns, sin),
        Row::accuracy("cos", turns, cos),
        Row::accuracy("atan2", "magnitudes from 2^-99 to 2^101, angles above 2^-100", angle(effort, num::atan2)),
    ]
}
