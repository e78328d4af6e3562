//! Path tracing: next-event estimation and BSDF sampling, joined by the balance heuristic (Veach 1997, §9.2).

mod params;

pub use params::*;

use crate::camera::camera_ray;
use crate::film::{CUT, sum_block};
use crate::geometry::Ray;
use crate::layout::{FEATURE_VOLUME, FilmPixel};
use crate::num;
use crate::rng::{self, Rng};
use crate::scene::{LightSample, Lights, Surface, SurfacePoint, Trace};
use crate::transport::{Connection, Vertex};
use crate::vec::{dot, flush, max_component};
use glam::Vec3;

/// Random dimensions: after the camera's [`DIMENSIONS_PER_SEGMENT`] a segment, used or not, so that a
/// decision keeps its numbers whatever was decided before it.
const FIRST_DIMENSION: u32 = 1;
const DIMENSIONS_PER_SEGMENT: u32 = 3;
const LIGHT: u32 = 0;
const SCATTER: u32 = 1;
const ROULETTE: u32 = 2;
/// Roulette leaves paths of up to three segments alone.
const ROULETTE_FROM: u32 = 3;
const MIN_SURVIVAL: f32 = 0.05;
/// The sum of one block of samples of the pixel (x, y).
pub fn pixel<S: Trace + Surface + Lights>(scene: &S, params: &PathParams, x: u32, y: u32) -> FilmPixel {
    sum_block(params.first_sample, params.block_log2, |sample| {
        let rng = Rng::new(x, y, sample, params.seed);
        let ray = camera_ray(&params.camera, params.flags & PATH_JITTER != 0, &rng, x, y);
        radiance(scene, ray, &rng, params.max_depth, params.flags & PATH_ROULETTE != 0)
    })
}

/// How the current segment's direction was chosen.
#[derive(Clone, Copy)]
struct Chosen {
    /// Density per steradian.
    pdf: f32,
    /// Next-event estimation could not have chosen it: the camera's ray, and scattering by a delta lobe.
    alone: bool,
}

/// An estimate of the radiance that arrives along `ray`, whose direction has unit length, over paths of up to
/// `max_depth` segments.
pub fn radiance<S: Trace + Surface + Lights>(scene: &S, ray: Ray, rng: &Rng, max_depth: u32, roulette: bool) -> Vec3 {
    let mut ray = ray;
    let mut sum = Vec3::ZERO;
    let mut throughput = Vec3::ONE;
    let mut chosen = Chosen { pdf: 0.0, alone: true };
    let mut depth = 0;
    let mut alive = depth < max_depth;
    while alive {
        let hit = scene.closest(&ray);
        alive = hit.is_hit();
        if hit.is_cut() {
            sum = CUT;
        } else if !alive {
            let environment = scene.environment(ray.direction);
            if max_component(environment.radiance) > 0.0 {
                sum += throughput * environment.radiance * environment_weight(environment.density, chosen);
            }
        }
        if alive {
            let point = scene.surface(&ray, &hit);
            let features = scene.features();
            if features & FEATURE_VOLUME != 0 && dot(point.normal, ray.direction) > 0.0 {
                throughput = flush(throughput * transmittance(point.absorption, hit.t));
            }
            if max_component(point.emission) > 0.0 {
                let weight = emission_weight(scene.light_density(&hit), &point, &ray, hit.t, chosen);
                sum += throughput * point.emission * weight;
            }
            depth += 1;
            alive = depth < max_depth && max_component(throughput) > 0.0;
            if alive {
                let dimension = FIRST_DIMENSION + (depth - 1).wrapping_mul(DIMENSIONS_PER_SEGMENT);
                let vertex = Vertex::new(&point, &ray, features);
                if vertex.bsdf.has_smooth_part() {
                    let light = scene.sample_light(rng.draw(dimension + LIGHT));
                    let connection = vertex.connect(&light);
                    if max_component(connection.value) > 0.0 && !scene.occluded(&connection.shadow) {
                        sum += throughput * next_event(&light, &connection);
                    }
                }
                let scattered = vertex.bsdf.sample(rng.draw(dimension + SCATTER));
                let direction = vertex.frame.to_world(scattered.direction);
                chosen = Chosen { pdf: scattered.pdf, alone: scattered.delta };
                throughput = flush(throughput * scattered.weight);
                ray = Ray { origin: vertex.origin(direction), direction, t_max: Ray::FAR };
                alive = (scattered.pdf > 0.0) & vertex.is_consistent(direction, scattered.direction);
                if roulette && depth >= ROULETTE_FROM {
                    let survival = num::clamp(max_component(throughput), MIN_SURVIVAL, 1.0);
                    alive = alive && rng::unit(rng.draw(dimension + ROULETTE).x) < survival;
                    throughput *= num::recip(survival);
                }
            }
        }
    }
    if alive { CUT } else { sum }
}

/// Light from a sampled point, with the balance heuristic's weight folded in: with w = l / (l + s), the value f cos L / l
/// times w is f cos L / (l + s), where l and s are the densities per steradian of the light and of scattering.
#[inline(always)]
fn next_event(light: &LightSample, connection: &Connection) -> Vec3 {
    let Connection { value, scatter_pdf, cos_light, distance_squared, .. } = *connection;
    value * num::div(cos_light, light.density * distance_squared + scatter_pdf * cos_light)
}

/// The share of light that is left after a distance `t` (Beer and Lambert).
#[inline(always)]
fn transmittance(absorption: Vec3, t: f32) -> Vec3 {
    Vec3::new(num::exp(-(absorption.x * t)), num::exp(-(absorption.y * t)), num::exp(-(absorption.z * t)))
}

/// The weight of emission that scattering found: its density over the sum of both strategies' densities.
#[inline(always)]
fn emission_weight(light_density: f32, point: &SurfacePoint, ray: &Ray, t: f32, chosen: Chosen) -> f32 {
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

/// As [`emission_weight`], for the environment.
#[inline(always)]
fn environment_weight(density: f32, chosen: Chosen) -> f32 {
    if chosen.alone { 1.0 } else { num::div(chosen.pdf, chosen.pdf + density) }
}
