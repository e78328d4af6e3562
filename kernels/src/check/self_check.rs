//! Probes of the numeric contract: the discriminators, and the functions of `num` that every technique uses, on given
//! operands. `num_probe` has the others.

use restir_shared::layout::Extent;
use restir_shared::num::{self, eft};

/// Parameters of the kernel `self_check`.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct SelfCheckParams {
    /// Number of probes.
    pub count: u32,
}

impl Extent for SelfCheckParams {
    fn extent(&self) -> [u32; 2] {
        [self.count, 1]
    }
}

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
        params 0: SelfCheckParams,
        read { 1: operands: Operands },
        own { 2: results: Results },
    }
    |x, _y, at, _p| results[at] = probe(operands[x as usize])
}

#[cfg(not(target_arch = "spirv"))]
fn cases(_: &dyn crate::CaseScenes) -> Vec<crate::Case> {
    [("boundaries", crate::probe::boundary_operands()), ("random", crate::probe::random_operands(4096))]
        .map(|(name, operands)| {
            let count = operands.len() as u32;
            crate::Case::new(name, count, 1).with(&[SelfCheckParams { count }]).with(&operands).output()
        })
        .into()
}
