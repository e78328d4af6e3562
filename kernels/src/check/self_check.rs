//! Probes of the numeric contract: the discriminators, and the functions of `num` that every technique uses, on given
//! operands. `num_probe` has the others.

use super::Probes;
#[cfg(not(target_arch = "spirv"))]
use restir_shared::glam::UVec4;
use restir_shared::num::{self, eft};
#[cfg(not(target_arch = "spirv"))]
use restir_shared::rng::{pcg4d, unit};

/// Operands of a probe.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Operands {
    /// First operand.
    pub a: f32,
    /// Second operand.
    pub b: f32,
    /// Third operand.
    pub c: f32,
    /// Fourth operand: which probe's bits are meant to differ on a build that breaks the contract.
    pub d: f32,
}

/// Results of a probe: the first five discriminate builds that contract, fuse or reassociate; the rest are `num`.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Results {
    /// `a b + c`: differs when the product is fused into the sum.
    pub fused: f32,
    /// `(a - b) + b`: differs when reassociated.
    pub cancelled: f32,
    /// `c - (c - a)`: differs when reassociated, the heart of the error-free transforms.
    pub split: f32,
    /// `(a c1) c2`: differs when the constants are multiplied first.
    pub scaled: f32,
    /// `a + (b - b)`: differs for minus zero when the sum is dropped. (A constant zero would not do: lavapipe drops
    /// that whatever the module says, which is why the allow-list rejects it.)
    pub plus_zero: f32,
    /// The error of the product `a b`.
    pub product_error: f32,
    /// The error of the sum `a + b`.
    pub sum_error: f32,
    /// `a / b`.
    pub div: f32,
    /// `1 / b`.
    pub recip: f32,
    /// sqrt(|a|).
    pub sqrt: f32,
    /// 1 / sqrt(|b|).
    pub rsqrt: f32,
    /// e^d.
    pub exp: f32,
    /// ln |a|.
    pub ln: f32,
    /// sin of d turns.
    pub sin: f32,
    /// cos of d turns.
    pub cos: f32,
    /// The angle of (a, b) in turns.
    pub atan2: f32,
}

const C1: f32 = 1.1;
const C2: f32 = 0.9;

#[expect(clippy::eq_op, reason = "a zero that no compiler may assume")]
fn probe(o: Operands) -> Results {
    let (_, product_error) = eft::two_prod(o.a, o.b);
    let (_, sum_error) = eft::two_sum(o.a, o.b);
    let (sin, cos) = num::sin_cos(o.d);
    Results {
        fused: o.a * o.b + o.c,
        cancelled: (o.a - o.b) + o.b,
        split: o.c - (o.c - o.a),
        scaled: o.a * C1 * C2,
        plus_zero: o.a + (o.b - o.b),
        product_error,
        sum_error,
        div: num::div(o.a, o.b),
        recip: num::recip(o.b),
        sqrt: num::sqrt(num::abs(o.a)),
        rsqrt: num::rsqrt(num::abs(o.b)),
        exp: num::exp(o.d),
        ln: num::ln(num::abs(o.a)),
        sin,
        cos,
        atan2: num::atan2(o.a, o.b),
    }
}

kernel! {
    /// Evaluates one probe an invocation.
    pub fn self_check(64, 1) {
        constants {}
        params 0: Probes,
        read { 1: operands: Operands },
        own { 2: results: Results },
    }
    |x, _y, at, _p| results[at] = probe(operands[x as usize])
}

/// Operands at the ends of the domain and where a broken contract shows.
#[cfg(not(target_arch = "spirv"))]
pub fn boundary_operands() -> Vec<Operands> {
    let one_and = |k: u32| f32::from_bits(0x3f80_0000 + k);
    let values = [
        1.0,
        -1.0,
        0.0,
        -0.0,
        3.0,
        -0.333_333_34,
        one_and(1),
        one_and(2048),
        -one_and(0x7f_ffff),
        f32::from_bits(0x3f7f_ffff),
        16_777_215.0,
        1.0e-12,
        -7.5e11,
        f32::from_bits(0x3080_0001),
        f32::from_bits(0x4eff_ffff),
    ];
    let mut operands = Vec::new();
    for a in values {
        for b in values {
            // c cancels the rounded product, so that a fused sum leaves its error
            operands.push(Operands { a, b, c: -(a * b), d: a - num::min(b, 1.0) });
            operands.push(Operands { a, b, c: 4097.0 * a, d: b * 0.125 });
        }
    }
    operands.iter().map(|o| Operands { d: num::clamp(o.d, -80.0, 80.0), ..*o }).collect()
}

/// Pseudo-random operands, magnitudes in [2^-30, 2^30].
#[cfg(not(target_arch = "spirv"))]
pub fn random_operands(count: u32) -> Vec<Operands> {
    let value = |word: u32| f32::from_bits((word & 0x807f_ffff) | ((97 + (word >> 23) % 60) << 23));
    (0..count)
        .map(|i| {
            let w = pcg4d(UVec4::new(i, 0, 0, 99));
            let (a, b) = (value(w.x), value(w.y));
            let c = if i % 2 == 0 { -(a * b) } else { 4097.0 * a };
            Operands { a, b, c, d: (unit(w.w) - 0.5) * 160.0 }
        })
        .collect()
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    super::probes(&DESC, [("boundaries", boundary_operands()), ("random", random_operands(4096))])
}
