//! Division and roots against their correctly rounded values.

use super::sweep::{error_unless, sweep, sweep_pairs, sweep_patterns};
use super::{Effort, Row, Sweep, Tally, exact};
use crate::random::SplitMix;
use restir_shared::num::{self, soft};

/// Biased exponents of unary operands: the ends of the range, both parities, around 1, where results leave the range.
const EXPONENTS: [u32; 18] = [1, 2, 3, 4, 63, 64, 124, 125, 126, 127, 128, 129, 190, 191, 251, 252, 253, 254];
const MANTISSAS: u64 = 1 << 23;
/// Of these a few have subnormal operands.
const PAIRS: u64 = 1_010_000_000;
/// A prime, so that the subset has no pattern in the mantissa's bits.
const REDUCED_STRIDE: u64 = 67;
const REDUCED_PAIR_STRIDE: u64 = 337;
const REDUCED_PATTERN_STRIDE: u64 = 4_099;

/// Operands at which something changes; each is used with both signs.
const BOUNDARY: [u32; 22] = [
    0x0000_0000, // zero
    0x0000_0001, // subnormals
    0x007f_ffff,
    0x0080_0000, // smallest normal numbers
    0x0080_0001,
    0x00ff_ffff,
    0x0100_0000,
    0x3eff_ffff, // around 1/2, 1 and 2
    0x3f00_0000,
    0x3f7f_fffe,
    0x3f7f_ffff,
    0x3f80_0000,
    0x3f80_0001,
    0x3fff_ffff,
    0x4000_0000,
    0x7e7f_ffff, // around the largest number with a normal reciprocal
    0x7e80_0000,
    0x7e80_0001,
    0x7f7f_fffe, // largest numbers
    0x7f7f_ffff,
    0x7f80_0000, // infinity
    0x7fc0_0000, // NaN
];

fn boundary() -> Vec<f32> {
    let signed = |bits: u32| [f32::from_bits(bits), f32::from_bits(bits | 1 << 31)];
    BOUNDARY.into_iter().flat_map(signed).collect()
}

/// What a form does with subnormal numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subnormals {
    /// Operands count as zero, results are zero.
    Zero,
    /// Outside the contract: such operands are not tested, and a result whose exact value is below the normal
    /// numbers may be anything up to their smallest.
    Unspecified,
}

impl Subnormals {
    fn accepts(self, x: f32) -> bool {
        self == Self::Zero || !x.is_subnormal()
    }

    /// Equal bits, or both NaN, or a result that underflowed.
    fn allow(self, computed: f32, expected: f32) -> bool {
        let underflow = expected == 0.0 && computed.abs() <= f32::MIN_POSITIVE;
        computed.to_bits() == expected.to_bits()
            || (computed.is_nan() && expected.is_nan())
            || (self == Self::Unspecified && underflow)
    }
}

/// A function of one operand over all mantissas (all of a stride) under representative exponents, and the
/// boundary values.
pub fn unary(
    effort: Effort,
    subnormals: Subnormals,
    function: impl Fn(f32) -> f32 + Sync,
    oracle: impl Fn(f32) -> f32 + Sync,
) -> Tally {
    let visit = |x: f32, tally: &mut Tally| {
        if subnormals.accepts(x) {
            tally.check(u64::from(x.to_bits()), subnormals.allow(function(x), oracle(x)));
        }
    };
    let stride = effort.stride(REDUCED_STRIDE);
    sweep(MANTISSAS.div_ceil(stride), 0.0, |i, tally| {
        if i == 0 {
            boundary().into_iter().for_each(|x| visit(x, tally));
        }
        for exponent in EXPONENTS {
            visit(f32::from_bits((exponent << 23) | (i * stride) as u32), tally);
        }
    })
}

/// Division of random pairs, and of all pairs of boundary values.
pub fn division(effort: Effort, subnormals: Subnormals, function: impl Fn(f32, f32) -> f32 + Sync) -> Tally {
    sweep_pairs(PAIRS / effort.stride(REDUCED_PAIR_STRIDE), 0.0, &boundary(), random_pair, |a, b| {
        let right = || subnormals.allow(function(a, b), exact::div(a, b));
        (subnormals.accepts(a) && subnormals.accepts(b)).then(|| error_unless(right()))
    })
}

/// A quarter has any bits at all; of the others, whose quotient is a normal number, half have mantissas close to
/// each other or to the ends of their range, where quotients lie close to a change of exponent.
fn random_pair(index: u64) -> (f32, f32) {
    let mut random = SplitMix::new(index);
    let word = random.word();
    let (a, b) = (word as u32, (word >> 32) as u32);
    let moderate = |bits: u32| f32::from_bits((bits & 0x807f_ffff) | ((96 + ((bits >> 23) & 63)) << 23));
    match index % 4 {
        0 => (f32::from_bits(a), f32::from_bits(b)),
        1 => (moderate(a), moderate(b)),
        2 => (moderate(a), moderate((b & !0x007f_ffff) | (a.wrapping_add(b & 63).wrapping_sub(32) & 0x007f_ffff))),
        _ => (moderate(a | 0x007f_ff00), moderate(if b & 256 == 0 { b | 0x007f_ff00 } else { b & !0x007f_ff00 })),
    }
}

/// Whether the two forms of a function give the same bits, over all bit patterns (all of a stride).
fn agreement(effort: Effort, device: fn(f32) -> f32, host: fn(f32) -> f32) -> Tally {
    sweep_patterns(effort.stride(REDUCED_PATTERN_STRIDE), 0.0, |bits, tally| {
        let x = f32::from_bits(bits);
        tally.check(bits.into(), Subnormals::Unspecified.allow(host(exact::flush(x)), exact::flush(device(x))));
    })
}

/// The sweeps of the table.
pub(super) fn sweeps() -> Vec<Sweep> {
    type Unary = fn(f32) -> f32;
    let unaries: [(&str, Unary, Unary, Unary); 3] = [
        ("recip", soft::recip, num::recip, exact::recip),
        ("sqrt", soft::sqrt, num::sqrt, exact::sqrt),
        ("rsqrt", soft::rsqrt, num::rsqrt, exact::rsqrt),
    ];
    let domain = "all numbers";
    let mut sweeps = vec![Sweep::new("div", move |effort| {
        vec![
            Row::rounding("div", "device", domain, division(effort, Subnormals::Zero, soft::div)),
            Row::rounding("div", "host", domain, division(effort, Subnormals::Unspecified, num::div)),
        ]
    })];
    sweeps.extend(unaries.map(|(name, device, host, oracle)| {
        Sweep::new(name, move |effort| {
            vec![
                Row::rounding(name, "device", domain, unary(effort, Subnormals::Zero, device, oracle)),
                Row::rounding(name, "host", domain, unary(effort, Subnormals::Unspecified, host, oracle)),
                Row::rounding(name, "device = host", "all bit patterns", agreement(effort, device, host)),
            ]
        })
    }));
    sweeps
}
