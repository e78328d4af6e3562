//! The elementary functions against `f64`, whose own error is below a thousandth of the unit used here: the functions of
//! the standard library are within a few units of 2^-53, and none of the formulas below cancels.

use super::sweep::sweep;
use super::{Effort, MAX_ULP, Row, Sweep, Tally};
use crate::random::SplitMix;
use restir_shared::color;
use restir_shared::num::{self, EXP_MIN, TURNS_MAX, eft};
use std::f64::consts::TAU;

/// Of these a few are outside the domains.
const PAIRS: u64 = 1_020_000_000;
const PATTERNS: u64 = 1 << 32;
const REDUCED_STRIDE: u64 = 4_099;
/// Angles below this are outside the contract: their terms are subnormal.
const SMALLEST_ANGLE: f64 = num::FLUSH_BELOW as f64;
/// The operands of `atan2` have biased exponents in this range: sums and quotients stay normal numbers.
const ATAN_EXPONENTS: std::ops::Range<u32> = 28..228;
/// Factors have biased exponents in this range: their products and the errors of these are normal numbers.
const FACTOR_EXPONENTS: std::ops::Range<u32> = 90..186;
const TWO_POW_128: f64 = f32::MAX as f64 + 2.028_240_960_365_167e31;
const SMALLEST: f64 = f32::MIN_POSITIVE as f64;

/// The distance between neighbours of `x` among the `f32` of its binade; that of the smallest normal numbers below.
pub fn ulp(x: f64) -> f64 {
    let exponent = ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    f64::exp2(f64::from(exponent.clamp(-126, 127) - 23))
}

/// |computed - exact| in units in the last place. Where the exact value is zero, infinite or a NaN nothing else is
/// right; infinity counts as 2^128; at and below the smallest normal number zero is right as well.
pub fn error(computed: f32, exact: f64) -> f64 {
    let value = f64::from(computed).clamp(-TWO_POW_128, TWO_POW_128);
    let right = if exact.is_nan() {
        computed.is_nan()
    } else if exact == 0.0 || exact.is_infinite() {
        f64::from(computed) == exact
    } else if exact.abs() <= SMALLEST {
        value.abs() <= SMALLEST
    } else if exact.abs() < SMALLEST * (1.0 + f64::exp2(-23.0)) && value == 0.0 {
        true
    } else {
        return (value - exact.clamp(-TWO_POW_128, TWO_POW_128)).abs() / ulp(exact);
    };
    if right { 0.0 } else { f64::INFINITY }
}

/// A function of one number, and what it should be.
#[derive(Clone, Copy)]
pub struct Function {
    /// Its name.
    pub name: &'static str,
    /// The function.
    pub function: fn(f32) -> f32,
    /// Its exact value for every number, also outside the domain.
    pub exact: fn(f64) -> f64,
    /// The largest error in units in the last place that it may have.
    pub limit: f64,
}

/// The sRGB curves as IEC 61966-2-1 has them.
fn srgb_encode(x: f64) -> f64 {
    if x <= 0.003_130_8_f32.into() { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

fn srgb_decode(x: f64) -> f64 {
    if x <= 0.040_45_f32.into() { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// Zero where [`num::exp`] is documented to be so, although the smallest results would be normal numbers.
fn exp(x: f64) -> f64 {
    if x < EXP_MIN.into() { 0.0 } else { x.exp() }
}

/// All functions of one number whose domain is all numbers.
pub const FUNCTIONS: [Function; 13] = [
    Function { name: "exp", function: num::exp, exact: exp, limit: MAX_ULP },
    Function { name: "exp2", function: num::exp2, exact: f64::exp2, limit: MAX_ULP },
    Function { name: "expm1", function: num::expm1, exact: f64::exp_m1, limit: MAX_ULP },
    Function { name: "ln", function: num::ln, exact: f64::ln, limit: MAX_ULP },
    Function { name: "log2", function: num::log2, exact: f64::log2, limit: MAX_ULP },
    Function { name: "ln_1p", function: num::ln_1p, exact: f64::ln_1p, limit: MAX_ULP },
    Function { name: "sinh", function: num::sinh, exact: f64::sinh, limit: MAX_ULP },
    Function { name: "asinh", function: num::asinh, exact: f64::asinh, limit: MAX_ULP },
    Function { name: "acos", function: num::acos, exact: |x| x.clamp(-1.0, 1.0).acos() / TAU, limit: MAX_ULP },
    Function { name: "asin", function: num::asin, exact: |x| x.clamp(-1.0, 1.0).asin() / TAU, limit: ASIN_ULP },
    Function { name: "cbrt", function: num::cbrt, exact: f64::cbrt, limit: MAX_ULP },
    Function { name: "srgb_encode", function: color::srgb_encode, exact: srgb_encode, limit: SRGB_ULP },
    Function { name: "srgb_decode", function: color::srgb_decode, exact: srgb_decode, limit: SRGB_ULP },
];

/// From 1/2 on a quarter of a turn less an angle twice as large as the result.
const ASIN_ULP: f64 = 2.5;
/// The exponents 2.4 and 1 / 2.4 are rounded, which counts the more the farther from 1.
const SRGB_ULP: f64 = 16.0;

/// All bit patterns, or every 4099th. A subnormal operand may count as zero.
pub fn unary(
    effort: Effort,
    limit: f64,
    function: impl Fn(f32) -> f32 + Sync,
    exact: impl Fn(f64) -> f64 + Sync,
) -> Tally {
    let stride = effort.stride(REDUCED_STRIDE);
    let [tally] = sweep(PATTERNS.div_ceil(stride), limit, |i, [tally]| {
        let x = f32::from_bits((i * stride) as u32);
        let computed = function(x);
        let found = error(computed, exact(x.into()));
        let found = if x.is_subnormal() { found.min(error(computed, exact(0.0))) } else { found };
        tally.record(u64::from(x.to_bits()), found);
    });
    tally
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

/// Powers of random operands: a quarter of any bits at all, the others with a result of any magnitude; of these a third
/// with a base close to 1.
pub fn power(effort: Effort, function: impl Fn(f32, f32) -> f32 + Sync) -> Tally {
    let visit = |x: f32, y: f32, tally: &mut Tally| {
        let input = u64::from(x.to_bits()) << 32 | u64::from(y.to_bits());
        tally.record(input, error(function(x, y), exact_power(x, y)));
    };
    let [tally] = sweep(PAIRS / effort.stride(REDUCED_STRIDE), MAX_ULP, |i, [tally]| {
        if i == 0 {
            let edges = [0.0, -0.0, 1.0, f32::MIN_POSITIVE, f32::MAX, f32::INFINITY, f32::NAN, 0.5, 3.0e9, 1.0e-30];
            let signed = || edges.into_iter().flat_map(|y| [y, -y]);
            signed().for_each(|x| signed().for_each(|y| visit(x, y, tally)));
        }
        let (x, y) = random_power(i);
        if !x.is_subnormal() && !y.is_subnormal() {
            visit(x, y, tally);
        }
    });
    tally
}

/// x^y, NaN where an operand is a NaN or the base negative.
fn exact_power(x: f32, y: f32) -> f64 {
    if x < 0.0 || x.is_nan() || y.is_nan() { f64::NAN } else { f64::from(x).abs().powf(y.into()) }
}

fn random_power(index: u64) -> (f32, f32) {
    let mut random = SplitMix::new(index);
    let word = random.word();
    let (a, b) = (word as u32, (word >> 32) as u32);
    let any = f32::from_bits(a & 0x7fff_ffff);
    let base = match index % 4 {
        0 => return (any, f32::from_bits(b)),
        1 => f32::from_bits((a & 0x007f_ffff).wrapping_add(126 << 23) + (a >> 31 << 23)),
        2 => f32::from_bits(0x3f80_0000_u32.wrapping_add_signed((a as i32) >> (8 + (b & 15)))),
        _ => f32::from_bits((a & 0x007f_ffff) | (1 + (a >> 23) % 254) << 23),
    };
    let target = random.range(-127.0, 129.0);
    (base, (target / f64::from(base).log2()) as f32)
}

/// Sums of two products of random factors: a quarter independent, in the others the second product is close to the
/// negative of the first. The sum of two exact products is rounded once in `f64`.
pub fn product_sum(effort: Effort, function: impl Fn([f32; 4]) -> f32 + Sync) -> Tally {
    let [tally] = sweep(PAIRS / effort.stride(REDUCED_STRIDE), MAX_ULP, |i, [tally]| {
        let [a, b, c, d] = random_factors(i);
        let exact = f64::from(a) * f64::from(b) + f64::from(c) * f64::from(d);
        tally.record(i, error(function([a, b, c, d]), exact));
    });
    tally
}

fn random_factors(index: u64) -> [f32; 4] {
    let mut random = SplitMix::new(index);
    let mut factor = || {
        let word = random.word();
        let exponent = FACTOR_EXPONENTS.start + ((word >> 32) as u32) % FACTOR_EXPONENTS.len() as u32;
        f32::from_bits((word as u32 & 0x807f_ffff) | exponent << 23)
    };
    let [a, b, c] = std::array::from_fn(|_| factor());
    let beside = |x: f32| f32::from_bits(x.to_bits().wrapping_add(index as u32 >> 2 & 3));
    let magnitudes = FACTOR_EXPONENTS.start as f32 - 127.0..FACTOR_EXPONENTS.end as f32 - 127.0;
    match index % 4 {
        0 => [a, b, c, factor()],
        1 => [a, b, -beside(a), beside(b)],
        2 => [a, b, -beside(b), beside(a)],
        _ => {
            let d = -(f64::from(a) * f64::from(b) / f64::from(c)) as f32;
            if d != 0.0 && magnitudes.contains(&d.abs().log2()) { [a, b, c, d] } else { [a, b, b, -a] }
        }
    }
}

/// The sweeps of the table.
pub(super) fn sweeps() -> Vec<Sweep> {
    let of_one = FUNCTIONS.map(|f| {
        Sweep::new(f.name, move |effort| {
            vec![Row::accuracy(f.name, "all bit patterns", unary(effort, f.limit, f.function, f.exact))]
        })
    });
    let mut sweeps = Vec::from(of_one);
    sweeps.push(Sweep::new("sin_cos", |effort| {
        let [sin, cos] = sine_cosine(effort, num::sin_cos);
        let turns = "angles up to 2^20 turns";
        vec![Row::accuracy("sin", turns, sin), Row::accuracy("cos", turns, cos)]
    }));
    sweeps.push(Sweep::new("atan2", |effort| {
        let domain = "magnitudes from 2^-99 to 2^101, angles above 2^-100";
        vec![Row::accuracy("atan2", domain, angle(effort, num::atan2))]
    }));
    sweeps.push(Sweep::new("pow", |effort| vec![Row::accuracy("pow", "all normal numbers", power(effort, num::pow))]));
    sweeps.push(Sweep::new("difference_of_products", |effort| {
        let tally = product_sum(effort, |[a, b, c, d]| eft::difference_of_products(a, b, -c, d));
        vec![Row::accuracy_of_samples("difference_of_products", "factors from 2^-37 to 2^59", tally)]
    }));
    sweeps
}
