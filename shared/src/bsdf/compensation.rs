//! The light that single scattering of the specular lobes loses: metal returns it itself, under a coat the diffuse lobes do.

use super::albedo::{Albedo, Towards};
use super::{coat::Coat, markers};
use crate::num;
use glam::Vec3;

/// What a material returns by more than one reflection, seen from one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Compensation {
    /// There is a coat or metal that loses light.
    pub(super) needed: bool,
    albedo: Albedo,
    coat: Coat,
    /// `C(cos_o)`; without a coat 1.
    pub(super) passing: f32,
    /// The same over its mean.
    entering: f32,
    /// `g(cos_o)`.
    gain: f32,
    /// `m K` times the reflectance at normal incidence, and `m K`.
    f0: Vec3,
    f90: Vec3,
}

impl Compensation {
    pub(super) const NONE: Self = Self {
        needed: false,
        albedo: Albedo::NONE,
        coat: Coat::NONE,
        passing: 1.0,
        entering: 1.0,
        gain: 1.0,
        f0: Vec3::ZERO,
        f90: Vec3::ZERO,
    };

    /// The compensation of a coat and a share of metal of this base colour, seen at a cosine.
    #[inline(always)]
    pub(super) fn new(coat: Coat, metallic: f32, base: Vec3, roughness: f32, cos: f32) -> Self {
        let albedo = Albedo::new(roughness);
        let (own, mean) = (albedo.towards(cos), Albedo::mean(roughness));
        let passing = if coat.f90 > 0.0 { own.losses.of(coat.f0, coat.f90) } else { 1.0 };
        let passing_mean = if coat.f90 > 0.0 { mean.of(coat.f0, coat.f90) } else { 1.0 };
        let f90 = color(base, mean.all) * metallic;
        let entering = num::div(passing, passing_mean);
        Self { needed: true, albedo, coat, passing, entering, gain: own.gain, f0: base * f90, f90 }
    }

    /// For light at a cosine.
    #[inline(always)]
    pub(super) fn towards(&self, cos: f32) -> Towards {
        self.albedo.towards(cos)
    }

    /// `C(cos_o) C(cos_i) / mean C`.
    #[inline(always)]
    pub(super) fn coupling(&self, light: &Towards) -> f32 {
        if self.coat.f90 > 0.0 { self.entering * light.losses.of(self.coat.f0, self.coat.f90) } else { 1.0 }
    }

    /// `(g(cos_o) g(cos_i) - 1) m K F`, where Schlick's weight is `weight`.
    #[inline(always)]
    pub(super) fn interreflected(&self, light: &Towards, weight: f32) -> Vec3 {
        (self.f0 + (self.f90 - self.f0) * weight) * (self.gain * light.gain - 1.0)
    }
}

/// K: the colour of the light that leaves metal after more than one reflection, of which a share `lost` meets another facet
/// each time, over that of the first reflection: `a (1 - lost) / (1 - a lost)` (Fdez-Aguera 2019, eq. 18).
#[inline(always)]
fn color(base: Vec3, lost: f32) -> Vec3 {
    let mean = Vec3::ONE - (Vec3::ONE - base) * markers::MULTISCATTER;
    let rest = Vec3::ONE - mean * lost;
    // one division for three
    let pairs = Vec3::new(rest.y * rest.z, rest.z * rest.x, rest.x * rest.y);
    mean * pairs * ((1.0 - lost) * num::recip(rest.x * pairs.x))
}
