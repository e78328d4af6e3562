//! Mixtures of exponential densities and of lobes, in `f64`; each law beside known-wrong forms that it must refuse.

extern crate std;

mod cells;
mod inversion;
mod jacobian;
mod lobes;
mod replay;

use super::*;
use crate::rng::pcg4d;
use glam::UVec4;

/// Uniform random numbers, the same in every run.
struct Random {
    seed: u32,
    drawn: u32,
}

impl Random {
    fn new(seed: u32) -> Self {
        Self { seed, drawn: 0 }
    }

    /// In [0, 1), of 53 bits.
    fn unit(&mut self) -> f64 {
        self.drawn += 1;
        let words = pcg4d(UVec4::new(self.seed, self.drawn, 0, 1));
        let bits = u64::from(words.x) << 32 | u64::from(words.y);
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * self.unit()
    }
}

/// Exponential densities on r > 0, S_t(u) = -s_t ln(1 - u), and their weights.
#[derive(Clone, Copy)]
struct Exponentials<const N: usize> {
    weights: [f64; N],
    scales: [f64; N],
}

impl<const N: usize> Exponentials<N> {
    /// Random weights, of which none is above 6 times another; scales from 0.5 to 2.
    fn random(random: &mut Random) -> Self {
        let parts: [f64; N] = core::array::from_fn(|_| random.between(0.2, 1.2));
        let whole: f64 = parts.iter().sum();
        let scale = |t: usize| 0.5 * 4.0_f64.powf(t as f64 / (N - 1) as f64);
        Self { weights: parts.map(|part| part / whole), scales: core::array::from_fn(scale) }
    }

    fn sample(&self, technique: u32, u: f64) -> f64 {
        -self.scales[technique as usize] * (-u).ln_1p()
    }

    fn invert(&self, technique: u32, r: f64) -> f64 {
        -(-r / self.scales[technique as usize]).exp_m1()
    }

    fn densities(&self, r: f64) -> [f64; N] {
        self.scales.map(|scale| (-r / scale).exp() / scale)
    }

    fn density(&self, r: f64) -> f64 {
        density(&self.weights, &self.densities(r))
    }

    fn cdf(&self, r: f64) -> f64 {
        (0..N).map(|t| self.weights[t] * self.invert(t as u32, r)).sum()
    }
}

/// Nodes and weights of Gauss and Legendre's rule on [0, 1], exact for polynomials of degree 7.
const RULE: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// The integral over [lower, upper], by as many equal panels.
fn integral_by(panels: u32, [lower, upper]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    let width = (upper - lower) / f64::from(panels);
    let panel =
        |i: u32| -> f64 { RULE.map(|(node, weight)| weight * f(lower + (f64::from(i) + node) * width)).iter().sum() };
    (0..panels).map(|i| width * panel(i)).sum()
}

/// The integral, of which half as many panels differ by less than 10^-8: a smooth integrand's error is a small part of that.
fn integral(panels: u32, range: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    let (coarse, fine) = (integral_by(panels / 2, range, &f), integral_by(panels, range, &f));
    assert!((coarse - fine).abs() < 1e-8, "the quadrature gives {coarse} and {fine}");
    fine
}

/// The mean over a uniform number in [0, 1) of what depends on a technique alone that it decides, of two: the lower numbers decide for the
/// first, if any do.
fn mean_by(technique: impl Fn(f64) -> u32, value: impl Fn(u32) -> f64) -> f64 {
    let (mut lower, mut upper) = (0.0, 1.0);
    for _ in 0..53 {
        let middle = 0.5 * (lower + upper);
        if technique(middle) == 0 {
            lower = middle;
        } else {
            upper = middle;
        }
    }
    let part = |share: f64, technique: u32| if share > 0.0 { share * value(technique) } else { 0.0 };
    part(lower, 0) + part(1.0 - upper, 1)
}
