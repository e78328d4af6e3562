//! Weights of the balance heuristic (Veach 1997, §9.2) between next-event estimation and scattering.

use super::connect::Connection;
use crate::geometry::Ray;
use crate::num;
use crate::scene::SurfacePoint;
use crate::vec::dot;
use glam::Vec3;

/// How the direction of a segment was chosen.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    /// Density per steradian; of a delta lobe the probability of its selection; 0 of the first segment.
    pub pdf: f32,
    /// Next-event estimation could not have chosen it: the first segment, and scattering by a delta lobe.
    pub alone: bool,
}

impl Chosen {
    /// Of the first segment.
    pub const NONE: Self = Self { pdf: 0.0, alone: true };
}

#[cfg(not(target_arch = "spirv"))]
crate::lanes::soa! { Choices = Chosen { pdf: f32, alone: bool } }

/// Light from a sampled point, with the balance heuristic's weight folded in: with w = l / (l + s), the value f cos L / l
/// times w is f cos L / (l + s), where l and s are the densities per steradian of the light and of scattering. Scattering that
/// finds the same point has f cos L / s times s / (l + s), which is the same. `density` is that of the light sample.
#[inline(always)]
pub fn next_event(density: f32, connection: &Connection) -> Vec3 {
    let Connection { value, scatter_pdf, cos_light, distance_squared, .. } = *connection;
    value * num::div(cos_light, density * distance_squared + scatter_pdf * cos_light)
}

/// The weight of emission that scattering found at distance `t` along `ray`: its density over the sum of both strategies' densities.
/// `light_density` is per area.
#[inline(always)]
pub fn emission_weight<M>(light_density: f32, point: &SurfacePoint<M>, ray: &Ray, t: f32, chosen: Chosen) -> f32 {
    // the light's density per steradian is light_density t^2 / cos; multiplied out, so that cos may be zero
    let scatter = chosen.pdf * num::abs(dot(point.normal, ray.direction));
    let light = light_density * (t * t);
    if chosen.alone {
        1.0
    } else if scatter > 0.0 {
        num::div(scatter, scatter + light)
    } else {
        0.0
    }
}

/// As [`emission_weight`], for the environment, whose `density` is per steradian.
#[inline(always)]
pub fn environment_weight(density: f32, chosen: Chosen) -> f32 {
    if chosen.alone { 1.0 } else { num::div(chosen.pdf, chosen.pdf + density) }
}
