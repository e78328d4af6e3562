//! Mixtures of exponential densities, in `f64`; each law beside known-wrong forms that it must refuse.

extern crate std;

mod cells;
mod inversion;
mod jacobian;

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
