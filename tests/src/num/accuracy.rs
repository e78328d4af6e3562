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
/// Without their sign.
const PATTERNS: u64 = 1 << 31;
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
    power_of_two(exponent.clamp(-126, 127) - 23)
}

/// 2^k for k in [-1022, 1023].
pub(super) fn power_of_two(k: i32) -> f64 {
    f64::from_bits(((k + 1023) as u64) << 52)
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
    } else if exact.abs() < SMALLEST * (1.0 + f64::from(f32::EPSILON)) && value == 0.0 {
        true
    } else {
        return (value - exact.clamp(-TWO_POW_128, TWO_POW_128)).abs() / ulp(exact);
    };
    if right { 0.0 } else { f64::INFINITY }
}

/// A function of one number, and what it should be.
#[derive(Clone, Copy)]
pub struct Function {
    name: &'static str,
    function: fn(f32) -> f32,
    /// The value for every number, also outside the domain.
    exact: fn(f64) -> f64,
    limit: f64,
    is_odd: bool,
    largest: f32,
}

impl Function {
    /// A function of all numbers that has [`MAX_ULP`].
    pub const fn new(name: &'static str, function: fn(f32) -> f32, exact: fn(f64) -> f64) -> Self {
        Self { name, function, exact, limit: MAX_ULP, is_odd: false, largest: f32::INFINITY }
    }

    /// It changes its sign with its operand, to the bit: then the exact value is computed once for both.
    const fn odd(self) -> Self {
        Self { is_odd: true, ..self }
    }

    const fn within(self, limit: f64) -> Self {
        Self { limit, ..self }
    }

    const fn up_to(self, largest: f32) -> Self {
        Self { largest, ..self }
    }

    fn domain(&self) -> &'static str {
        if self.largest == f32::INFINITY { "all bit patterns" } else { "all bit patterns up to 1" }
    }

    /// A subnormal operand may count as zero.
    fn error(&self, x: f32, computed: f32) -> f64 {
        let found = error(computed, (self.exact)(x.into()));
        if x.is_subnormal() { found.min(error(computed, (self.exact)(0.0))) } else { found }
    }

    /// All bit patterns of the domain, or every 4099th.
    pub fn sweep(&self, effort: Effort) -> Tally {
        let stride = effort.stride(REDUCED_STRIDE);
        let [tally] = sweep(PATTERNS.div_ceil(stride), self.limit, |i, [tally]| {
            let x = f32::from_bits((i * stride) as u32);
            let (plus, minus) = ((self.function)(x), (self.function)(-x));
            let mut plus_error = 0.0;
            if x.is_nan() || x <= self.largest {
                plus_error = self.error(x, plus);
                tally.record(u64::from(x.to_bits()), plus_error);
            }
            let mirrored = self.is_odd && (minus.to_bits() == (-plus).to_bits() || x.is_nan());
            let minus_error = if mirrored { plus_error } else { self.error(-x, minus) };
            tally.record(u64::from((-x).to_bits()), minus_error);
        });
        tally
    }
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

/// All functions of one number.
///
/// The arc sine is a quarter of a turn less an angle up to twice as large as the result; the exponents of the sRGB curves
/// are rounded, which counts the more the farther from 1.
pub const FUNCTIONS: [Function; 13] = [
    Function::new("exp", num::exp, exp),
    Function::new("exp2", num::exp2, f64::exp2),
    Function::new("expm1", num::expm1, f64::exp_m1),
    Function::new("ln", num::ln, f64::ln),
    Function::new("log2", num::log2, f64::log2),
    Function::new("ln_1p", num::ln_1p, f64::ln_1p),
    Function::new("sinh", num::sinh, f64::sinh).odd(),
    Function::new("asinh", num::asinh, f64::asinh).odd(),
    Function::new("acos", num::acos, |x| x.clamp(-1.0, 1.0).acos() / TAU),
    Function::new("asin", num::asin, |x| x.clamp(-1.0, 1.0).asin() / TAU).odd().within(2.5),
    Function::new("cbrt", num::cbrt, f64::cbrt).odd(),
    Function::new("srgb_encode", color::srgb_encode, srgb_encode).up_to(1.0).within(4.0),
    Function::new("srgb_decode", color::srgb_decode, srgb_decode).up_to(1.0).within(6.0),
];

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
    let magnitudes = f64::from(FACTOR_EXPONENTS.start) - 127.0..f64::from(FACTOR_EXPONENTS.end) - 127.0;
    match index % 4 {
        0 => [a, b, c, factor()],
        1 => [a, b, -beside(a), beside(b)],
        2 => [a, b, -beside(b), beside(a)],
        _ => {
            let d = -(f64::from(a) * f64::from(b) / f64::from(c)) as f32;
            if d != 0.0 && magnitudes.contains(&f64::from(d.abs()).log2()) { [a, b, c, d] } else { [a, b, b, -a] }
        }
    }
}

/// The sweeps of the table.
pub(super) fn sweeps() -> Vec<Sweep> {
    let of_one =
        FUNCTIONS.map(|f| Sweep::new(f.name, move |effort| vec![Row::accuracy(f.name, f.domain(), f.sweep(effort))]));
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
