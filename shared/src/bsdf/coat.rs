//! The coat of the diffuse part.

use super::{Material, markers, schlick_complement};
use crate::layout::FEATURE_SPECULAR;
use crate::num;
use crate::vec::{max_component, min};
use glam::Vec3;

/// Schlick's reflectance of a coat.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat {
    /// At normal incidence, of the strongest channel, and at grazing incidence.
    pub(super) f0: f32,
    pub(super) f90: f32,
    /// `f90 - f0`.
    rise: f32,
    /// It has a factor and a colour: the latter at normal incidence.
    scaled: bool,
    color: Vec3,
}

impl Coat {
    pub(super) const NONE: Self = Self { f0: 0.0, f90: 0.0, rise: 0.0, scaled: false, color: Vec3::ZERO };

    /// The coat of a dielectric with these reflectances at normal and at grazing incidence; zero at both without a coat.
    #[inline(always)]
    pub(super) fn new(material: &Material, f0: f32, f90: f32, features: u32) -> Self {
        let scaled = features & FEATURE_SPECULAR != 0;
        let factor = if scaled { num::clamp(material.specular, markers::SPECULAR, 1.0) } else { 1.0 };
        let color = if scaled { min(material.specular_color * f0, Vec3::ONE) * factor } else { Vec3::ZERO };
        let f0 = if scaled { max_component(color) } else { f0 };
        Self { f0, f90: if scaled { factor * f90 } else { f90 }, rise: factor - f0, scaled, color }
    }

    /// A reflectance at normal incidence, together with this one times `share`.
    #[inline(always)]
    pub(super) fn beside(&self, other: Vec3, share: f32) -> Vec3 {
        if self.scaled { other + self.color * share } else { other + Vec3::splat(share * self.f0) }
    }

    /// `1 - Fs(cos)`.
    #[inline(always)]
    pub(super) fn clear(&self, cos: f32) -> f32 {
        let clear = self.rise * schlick_complement(cos);
        if self.scaled { (1.0 - self.f90) + clear } else { clear }
    }
}
