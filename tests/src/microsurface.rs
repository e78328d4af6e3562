//! Light between the facets of rough metal, by a random walk on Smith's microsurface in `f64` (Heitz, Hanika, d'Eon and Dachsbacher 2016,
//! "Multiple-scattering microfacet BSDFs with the Smith model"): what our metal approximates.

use crate::random::SplitMix;
use glam::DVec3;
use std::f64::consts::TAU;

/// Longer walks are cut. Of white metal at roughness 1, fewer than one in 10^9 are.
const MAX_REFLECTIONS: u32 = 1000;

/// A surface of facets with GGX's slopes.
#[derive(Clone, Copy, Debug)]
pub struct Microsurface {
    alpha: f64,
}

impl Microsurface {
    /// Of a perceptual roughness.
    pub fn new(roughness: f64) -> Self {
        Self { alpha: roughness * roughness }
    }

    /// The cosines at the facets that reflect a ray which comes from a viewer at a cosine, until it leaves.
    pub fn walk(&self, cos: f64, random: &mut SplitMix) -> Vec<f64> {
        let mut ray = -DVec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
        let mut height = Some(1.0);
        let mut cosines = Vec::new();
        for _ in 0..MAX_REFLECTIONS {
            height = height.and_then(|height| self.next_height(height, ray, random));
            if height.is_none() {
                break;
            }
            let normal = self.visible_normal(-ray, random);
            let cos = normal.dot(-ray);
            cosines.push(cos.clamp(0.0, 1.0));
            ray = (ray + 2.0 * cos * normal).normalize();
        }
        cosines
    }

    /// Where a ray meets the surface next, if it does; heights are the share of the surface below them. (Smith's heights may have any
    /// distribution.)
    fn next_height(&self, height: f64, ray: DVec3, random: &mut SplitMix) -> Option<f64> {
        let lambda = self.lambda(ray.z);
        let left = 1.0 - random.unit();
        let leaves = ray.z > 0.0 && left <= height.powf(lambda);
        (!leaves).then(|| (height * left.powf(-1.0 / lambda)).min(1.0))
    }

    /// Smith's Lambda of a direction, which is below -1 where it points down.
    fn lambda(&self, z: f64) -> f64 {
        let tangent_squared = self.alpha * self.alpha * (1.0 - z * z).max(0.0) / (z * z);
        0.5 * ((1.0 + tangent_squared).sqrt().copysign(z) - 1.0)
    }

    /// A normal that is seen along a direction, which may come from below (Heitz 2018, whose disk works for both).
    fn visible_normal(&self, from: DVec3, random: &mut SplitMix) -> DVec3 {
        let stretched = DVec3::new(self.alpha * from.x, self.alpha * from.y, from.z).normalize();
        let across = DVec3::new(-stretched.y, stretched.x, 0.0).normalize_or(DVec3::X);
        let up = stretched.cross(across);
        let (radius, (sin, cos)) = (random.unit().sqrt(), (TAU * random.unit()).sin_cos());
        let x = radius * cos;
        let share = 0.5 * (1.0 + stretched.z);
        let y = (1.0 - share) * (1.0 - x * x).sqrt() + share * radius * sin;
        let normal = x * across + y * up + (1.0 - x * x - y * y).max(0.0).sqrt() * stretched;
        DVec3::new(self.alpha * normal.x, self.alpha * normal.y, normal.z.max(0.0)).normalize_or(DVec3::Z)
    }
}

/// The share of light that metal returns whose reflectance at normal incidence is `base`, of a walk's cosines, by Schlick's approximation.
pub fn returned(base: f64, cosines: &[f64]) -> f64 {
    cosines.iter().map(|cos| base + (1.0 - base) * (1.0 - cos).powi(5)).product()
}
