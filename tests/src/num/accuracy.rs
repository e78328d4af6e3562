//! The elementary functions against `f64`, whose own error is below a thousandth of the unit used here: the functions of
//! the standard library are within a few units of 2^-53, and none of the formulas below cancels.

use super::sweep::{error_unless, sweep, sweep_all, sweep_pairs, sweep_patterns};
use super::{Effort, MAX_ULP, Row, Sweep, Tally};
use crate::random::SplitMix;
use restir_shared::color;
use restir_shared::num::{self, EXP_MIN, TURNS_MAX, eft};
use std::f64::consts::TAU;

/// Of these a few are outside the domains.
const PAIRS: u64 = 1_020_000_000;
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

/// 1 / ulp(x) for x between 2^-125 and 2^127.
#[inline(always)]
fn ulps_in_1(x: f64) -> f64 {
    f64::from_bits((2 * 1023 + 23 - ((x.to_bits() >> 52) & 0x7ff)) << 52)
}

/// Whether the result and the exact value are normal numbers by a factor.
#[inline(always)]
fn is_regular(computed: f32, exact: f64) -> bool {
    (exact.abs() >= 2.0 * SMALLEST) & (exact.abs() < 0.5 * TWO_POW_128) & (computed.abs() <= f32::MAX)
}

/// |computed - exact| in units in the last place. Where the exact value is zero, infinite or a NaN nothing else is
/// right; infinity counts as 2^128; at and below the smallest normal number zero is right as well.
pub fn error(computed: f32, exact: f64) -> f64 {
    if is_regular(computed, exact) {
        return (f64::from(computed) - exact).abs() * ulps_in_1(exact);
    }
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
    error_unless(right)
}

/// A function of one number, and what it should be.
#[derive(Clone, Copy)]
pub struct Function {
    name: &'static str,
    function: fn(f32) -> f32,
    /// The same function of every number of a slice, which the compiler makes vector instructions of.
    of_each: fn(&mut [f32]),
    /// The value for every number, also outside the domain.
    exact: fn(f64) -> f64,
    limit: f64,
    largest: f32,
}

/// A [`Function`] of all numbers that has [`MAX_ULP`].
macro_rules! function {
    ($name:literal, $function:expr, $exact:expr) => {
        Function {
            name: $name,
            function: $function,
            of_each: |numbers| numbers.iter_mut().for_each(|x| *x = $function(*x)),
            exact: $exact,
            limit: MAX_ULP,
            largest: f32::INFINITY,
        }
    };
}

impl Function {
    const fn within(self, limit: f64) -> Self {
        Self { limit, ..self }
    }

    const fn up_to(self, largest: f32) -> Self {
        Self { largest, ..self }
    }

    fn domain(&self) -> &'static str {
        if self.largest == f32::INFINITY { "all bit patterns" } else { "all bit patterns up to 1" }
    }

    /// All bit patterns of the domain, or every 4099th.
    fn sweep(&self, effort: Effort) -> Tally {
        match effort {
            Effort::Reduced => unary(self.limit, self.largest, self.function, self.exact),
            Effort::Full => sweep((1 << 32) / u64::from(BLOCK), self.limit, |i, tally| {
                let first = i as u32 * BLOCK;
                if !self.visit_regular(first, tally) {
                    let block = (first..=first + (BLOCK - 1)).map(f32::from_bits);
                    block.for_each(|x| visit(x, self.largest, self.function, self.exact, tally));
                }
            }),
        }
    }

    /// Visits a block if all its numbers are normal, inside the domain, and have normal values.
    fn visit_regular(&self, first: u32, tally: &mut Tally) -> bool {
        let mut computed: [f32; BLOCK as usize] = std::array::from_fn(|i| f32::from_bits(first + i as u32));
        let inside = computed[BLOCK as usize - 1] <= self.largest && computed[0] <= self.largest;
        let Some(interpolant) = inside.then(|| Interpolant::new(self.exact, first)).flatten() else {
            return false;
        };
        (self.of_each)(&mut computed);
        let mut errors = [0.0; BLOCK as usize];
        let mut regular = true;
        for (i, (error, computed)) in errors.iter_mut().zip(computed).enumerate() {
            let exact = interpolant.at(i as u32);
            regular &= is_regular(computed, exact);
            *error = (f64::from(computed) - exact).abs() * ulps_in_1(exact);
        }
        if regular {
            errors.iter().enumerate().for_each(|(i, &error)| tally.record(u64::from(first + i as u32), error));
        }
        regular
    }
}

/// A function of one number over every 4099th bit pattern up to a number.
pub fn unary(limit: f64, largest: f32, function: fn(f32) -> f32, exact: fn(f64) -> f64) -> Tally {
    sweep_patterns(REDUCED_STRIDE, limit, |bits, tally| visit(f32::from_bits(bits), largest, function, exact, tally))
}

/// One number, if it is in the domain. A subnormal operand may count as zero.
fn visit(x: f32, largest: f32, function: fn(f32) -> f32, exact: fn(f64) -> f64, tally: &mut Tally) {
    if x > largest {
        return;
    }
    let computed = function(x);
    let found = error(computed, exact(x.into()));
    let found = if x.is_subnormal() { found.min(error(computed, exact(0.0))) } else { found };
    tally.record(u64::from(x.to_bits()), found);
}

/// Neighbouring bit patterns over which an exact value is interpolated.
const BLOCK: u32 = 256;

/// The polynomial of degree 4 through five values of a function in a block: seven evaluations instead of 256.
struct Interpolant([f64; 5]);

impl Interpolant {
    const SPACING: u32 = BLOCK / 4;
    /// 2^-16 units in the last place.
    const TOLERANCE: f64 = 1.0 / (1_u64 << 40) as f64;

    /// `None` where it is off by more than the tolerance at the two places where its error is largest but for a tenth,
    /// as it is beside a kink, and where the block is special: subnormal, or with values that are zero or not finite.
    fn new(exact: fn(f64) -> f64, first: u32) -> Option<Self> {
        if !f32::from_bits(first).is_normal() {
            return None;
        }
        let value = |offset: u32| exact(f32::from_bits(first + offset).into());
        let [f0, f1, f2, f3] = std::array::from_fn(|i| value(i as u32 * Self::SPACING));
        // the last number of the last block has no successor
        let f4 = exact(f64::from(f32::from_bits(first)) + 4.0 * f64::from(spacing(first)) * f64::from(Self::SPACING));
        let (d1, d2, d3) = (f1 - f0, f2 - 2.0 * f1 + f0, f3 - 3.0 * (f2 - f1) - f0);
        let d4 = f4 - 4.0 * (f3 + f1) + 6.0 * f2 + f0;
        let interpolant = Self([f0, d1, d2 / 2.0, d3 / 6.0, d4 / 24.0]);
        let fits = |offset: u32| {
            let exact = value(offset);
            (interpolant.at(offset) - exact).abs() <= Self::TOLERANCE * exact.abs()
        };
        (f0 != 0.0 && fits(Self::SPACING / 2) && fits(BLOCK - Self::SPACING / 2)).then_some(interpolant)
    }

    #[inline(always)]
    fn at(&self, offset: u32) -> f64 {
        let t = f64::from(offset) * (1.0 / f64::from(Self::SPACING));
        let [c0, c1, c2, c3, c4] = self.0;
        c0 + t * (c1 + (t - 1.0) * (c2 + (t - 2.0) * (c3 + (t - 3.0) * c4)))
    }
}

/// The signed distance from the number of a bit pattern to that of the next, in the same binade.
fn spacing(bits: u32) -> f32 {
    f32::from_bits(bits + 1) - f32::from_bits(bits)
}

/// The sRGB curve from light to codes, as IEC 61966-2-1 has it.
fn srgb_encode(x: f64) -> f64 {
    if x <= 0.003_130_8_f32.into() { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// The sRGB curve from codes to light.
pub fn srgb_decode(x: f64) -> f64 {
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
const FUNCTIONS: [Function; 13] = [
    function!("exp", num::exp, exp),
    function!("exp2", num::exp2, f64::exp2),
    function!("expm1", num::expm1, f64::exp_m1),
    function!("ln", num::ln, f64::ln),
    function!("log2", num::log2, f64::log2),
    function!("ln_1p", num::ln_1p, f64::ln_1p),
    function!("sinh", num::sinh, f64::sinh),
    function!("asinh", num::asinh, f64::asinh),
    function!("acos", num::acos, |x| x.clamp(-1.0, 1.0).acos() / TAU),
    function!("asin", num::asin, |x| x.clamp(-1.0, 1.0).asin() / TAU).within(2.5),
    function!("cbrt", num::cbrt, f64::cbrt),
    function!("srgb_encode", color::srgb_encode, srgb_encode).up_to(1.0).within(4.0),
    function!("srgb_decode", color::srgb_decode, srgb_decode).up_to(1.0).within(6.0),
];

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
    let first = f32::MIN_POSITIVE.to_bits();
    let length = u64::from(TURNS_MAX.to_bits() - first);
    let stride = effort.stride(REDUCED_STRIDE);
    sweep_all(length.div_ceil(stride) + 1, MAX_ULP, |i, [sin, cos]| {
        let magnitude = f32::from_bits(first + (i * stride).min(length) as u32);
        for u in [magnitude, -magnitude] {
            let ((s, c), (exact_sin, exact_cos)) = (function(u), exact_sin_cos(u));
            sin.record(u.to_bits().into(), error(s, exact_sin));
            cos.record(u.to_bits().into(), error(c, exact_cos));
        }
    })
}

/// The angle of random vectors, of vectors close to the octants' borders and of the axes.
pub fn angle(effort: Effort, function: impl Fn(f32, f32) -> f32 + Sync) -> Tally {
    let axes = [0.0, -0.0, 1.0, -1.0, 3.0e-20, -3.0e20];
    sweep_pairs(PAIRS / effort.stride(REDUCED_STRIDE), MAX_ULP, &axes, random_vector, |y, x| {
        // a zero of either sign is the same zero
        let exact = (f64::from(y) + 0.0).atan2(f64::from(x) + 0.0) / TAU;
        (exact == 0.0 || exact.abs() >= SMALLEST_ANGLE).then(|| error(function(y, x), exact))
    })
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
    let edges = [0.0, -0.0, 1.0, f32::MIN_POSITIVE, f32::MAX, f32::INFINITY, f32::NAN, 0.5, 3.0e9, 1.0e-30];
    let edges: Vec<f32> = edges.into_iter().flat_map(|x| [x, -x]).collect();
    sweep_pairs(PAIRS / effort.stride(REDUCED_STRIDE), MAX_ULP, &edges, random_power, |x, y| {
        (!x.is_subnormal() && !y.is_subnormal()).then(|| error(function(x, y), exact_power(x, y)))
    })
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
    sweep(PAIRS / effort.stride(REDUCED_STRIDE), MAX_ULP, |i, tally| {
        let [a, b, c, d] = random_factors(i);
        let exact = f64::from(a) * f64::from(b) + f64::from(c) * f64::from(d);
        tally.record(i, error(function([a, b, c, d]), exact));
    })
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
    match index % 4 {
        0 => [a, b, c, factor()],
        1 => [a, b, -beside(a), beside(b)],
        2 => [a, b, -beside(b), beside(a)],
        _ => {
            let d = -(f64::from(a) * f64::from(b) / f64::from(c)) as f32;
            if FACTOR_EXPONENTS.contains(&(d.to_bits() >> 23 & 255)) { [a, b, c, d] } else { [a, b, b, -a] }
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
