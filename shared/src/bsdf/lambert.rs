//! Lambertian reflection alone.

use crate::num;
use crate::sampling::{cosine_hemisphere_pdf, sample_cosine_hemisphere};
use glam::{Vec2, Vec3};

/// Lambertian reflection.
#[derive(Clone, Copy)]
pub struct Lambert {
    /// Reflectance, linear RGB in [0, 1].
    pub reflectance: Vec3,
}

/// A direction drawn from Lambert's law.
#[derive(Clone, Copy)]
pub struct LambertSample {
    /// Unit direction, in the frame of the surface.
    pub direction: Vec3,
    /// Value times cosine over density.
    pub weight: Vec3,
    /// Density per steradian.
    pub pdf: f32,
}

impl Lambert {
    /// Value times cosine for light from a direction with the given z; zero below the horizon.
    #[inline(always)]
    pub fn eval_cos(&self, cos: f32) -> Vec3 {
        self.reflectance * (num::max(cos, 0.0) * num::INV_PI)
    }

    /// Density per steradian of [`Self::sample`].
    #[inline(always)]
    pub fn pdf(&self, cos: f32) -> f32 {
        cosine_hemisphere_pdf(cos)
    }

    /// Draws a direction in proportion to the cosine; `u` in [0, 1)^2.
    #[inline(always)]
    pub fn sample(&self, u: Vec2) -> LambertSample {
        let direction = sample_cosine_hemisphere(u);
        LambertSample { direction, weight: self.reflectance, pdf: self.pdf(direction.z) }
    }
}
