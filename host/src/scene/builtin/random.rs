//! Random numbers for building scenes: the same ones always.

use std::f64::consts::TAU;

use glam::DVec3;

/// SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014).
pub(in crate::scene) struct Random(u64);

impl Random {
    pub(in crate::scene) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in [0, 1), 53 bits.
    pub(in crate::scene) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in [lo, hi).
    pub(in crate::scene) fn range(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.unit()
    }

    /// Uniform on the unit sphere.
    pub(in crate::scene) fn direction(&mut self) -> DVec3 {
        let z = self.range(-1.0, 1.0);
        let (sin, cos) = self.range(0.0, TAU).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cos, z, radius * sin)
    }

    /// Uniform below `count`.
    pub(in crate::scene) fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }

    /// A power law: density in proportion to `x^(-1 - exponent)` from 1 to `most`.
    pub(in crate::scene) fn power_law(&mut self, exponent: f64, most: f64) -> f64 {
        let tail = most.powf(-exponent);
        (1.0 - self.unit() * (1.0 - tail)).powf(-1.0 / exponent)
    }
}
