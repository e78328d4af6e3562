//! What a material is at a point.

use super::{COS_MIN, DELTA_BELOW, Dielectric, NARROW_BELOW};
use crate::layout::{
    FEATURE_CLEAR, FEATURE_DELTA, FEATURE_DIFFUSE_TRANSMISSION, FEATURE_GLOSSY, FEATURE_MULTISCATTER, FEATURE_SPECULAR,
    FEATURE_TRANSMISSION,
};
use crate::num;
use glam::Vec3;

/// Parameters at a point, after textures: glTF's metallic-roughness model and its extensions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Linear RGB in [0, 1]: reflectance of metal and of the diffuse part, tint of what is transmitted.
    pub base_color: Vec3,
    /// Share of metal, in [0, 1].
    pub metallic: f32,
    /// Perceptual roughness in [0, 1]; GGX's alpha is its square.
    pub roughness: f32,
    /// Index of refraction in [1, [`super::IOR_MAX`]]; 1 for a surface without specular reflection, unless metallic.
    pub ior: f32,
    /// Strength of the specular reflection of what is neither metal nor transmits, in [0, 1] (`KHR_materials_specular`).
    pub specular: f32,
    /// Linear RGB >= 0: scales that reflection at normal incidence, which stays at most 1.
    pub specular_color: Vec3,
    /// Share of what is not metal that transmits specularly, in [0, 1].
    pub transmission: f32,
    /// Share of the diffuse part that is transmitted, in [0, 1].
    pub diffuse_transmission: f32,
    /// Linear RGB in [0, 1].
    pub diffuse_transmission_color: Vec3,
    /// The surface is a sheet: what is transmitted keeps its direction.
    pub thin: bool,
}

#[cfg(not(target_arch = "spirv"))]
crate::lanes::soa! {
    Materials = Material {
        base_color: Vec3, metallic: f32, roughness: f32, ior: f32, specular: f32, specular_color: Vec3, transmission: f32,
        diffuse_transmission: f32, diffuse_transmission_color: Vec3, thin: bool
    }
}

impl Material {
    /// Lambertian reflection.
    #[inline(always)]
    pub fn diffuse(reflectance: Vec3) -> Self {
        Self {
            base_color: reflectance,
            metallic: 0.0,
            roughness: 1.0,
            ior: 1.0,
            specular: 1.0,
            specular_color: Vec3::ONE,
            transmission: 0.0,
            diffuse_transmission: 0.0,
            diffuse_transmission_color: Vec3::ZERO,
            thin: false,
        }
    }

    /// The feature bits that this material needs. A textured material needs those of all its points: the sum of the
    /// bits at the extremes of its parameters.
    pub fn features(&self) -> u32 {
        let dielectric = 1.0 - self.metallic;
        let transmits = dielectric * self.transmission > 0.0;
        let coated = (dielectric * (1.0 - self.transmission) > 0.0) & (self.ior > 1.0);
        let specular = (self.metallic > 0.0) | transmits | ((dielectric > 0.0) & (self.ior > 1.0));
        let delta = self.roughness < DELTA_BELOW;
        let narrow = transmits & self.is_narrow();
        let mut features = 0;
        if specular & !delta {
            features |= FEATURE_GLOSSY;
        }
        if specular & (delta | narrow) {
            features |= FEATURE_DELTA;
        }
        if coated | ((self.metallic > 0.0) & !delta) {
            features |= FEATURE_MULTISCATTER;
        }
        if coated & ((self.specular != 1.0) | (self.specular_color != Vec3::ONE)) {
            features |= FEATURE_SPECULAR;
        }
        if transmits {
            features |= FEATURE_TRANSMISSION;
        }
        if transmits & self.thin & delta {
            features |= FEATURE_CLEAR;
        }
        if dielectric * (1.0 - self.transmission) * self.diffuse_transmission > 0.0 {
            features |= FEATURE_DIFFUSE_TRANSMISSION;
        }
        features
    }

    /// What passes straight through, of light at the cosine `cos` > 0 to the normal: the energy of the perfect lobe of
    /// transmission if this is a smooth sheet, else nothing.
    #[inline(always)]
    pub fn straight(&self, cos: f32) -> Vec3 {
        let clear = self.thin & (self.roughness < DELTA_BELOW) & (cos >= COS_MIN);
        let share = (1.0 - self.metallic) * self.transmission;
        let interface = Dielectric::new(self.ior, 1.0, true);
        let passed = interface.fresnel(cos, interface.bent(cos)).transmitted;
        if clear { self.base_color * (share * passed) } else { Vec3::ZERO }
    }

    /// Whether refraction makes the transmitted lobe too narrow to be resolved.
    #[inline(always)]
    pub(super) fn is_narrow(&self) -> bool {
        !self.thin & (self.roughness * self.roughness * num::abs(self.ior - 1.0) < NARROW_BELOW)
    }
}
