//! Path tracing: next-event estimation and BSDF sampling, joined by the balance heuristic (Veach 1997, §9.2).

use crate::bsdf::Lambert;
use crate::camera::primary_ray;
use crate::film::sum_block;
use crate::geometry::Ray;
use crate::layout::{FilmPixel, PATH_JITTER, PATH_ROULETTE, PathParams};
use crate::num;
use crate::rng::{self, Rng};
use crate::scene::{LightSample, Lights, Surface, SurfacePoint, Trace};
use crate::vec::{Frame, dot, max_component};
use glam::{Vec2, Vec3};

/// Random dimensions: one for the camera, then [`DIMENSIONS_PER_SEGMENT`] a segment, used or not, so that a
/// decision keeps its numbers whatever was decided before it.
const CAMERA_DIMENSION: u32 = 0;
const FIRST_DIMENSION: u32 = 1;
const DIMENSIONS_PER_SEGMENT: u32 = 2;
const LIGHT: u32 = 0;
const SCATTER: u32 = 1;
/// Roulette leaves paths of up to three segments alone.
const ROULETTE_FROM: u32 = 3;
const MIN_SURVIVAL: f32 = 0.05;
/// The radiance of a sample that a device which limits loops has cut short: beyond what the film accepts, so that it
/// is dropped and counted.
const CUT: Vec3 = Vec3::splat(f32::MAX);

/// The sum of one block of samples of the pixel (x, y).
pub fn pixel<S: Trace + Surface + Lights>(scene: &S, params: &PathParams, x: u32, y: u32) -> FilmPixel {
    sum_block(params.first_sample, params.block_log2, |sample| {
        let rng = Rng::new(x, y, sample, params.seed);
        let words = rng.draw(CAMERA_DIMENSION);
        let within = if params.flags & PATH_JITTER != 0 {
            Vec2::new(rng::unit(words.x), rng::unit(words.y))
        } else {
            Vec2::splat(0.5)
        };
        let ray = primary_ray(&params.camera, Vec2::new(x as f32, y as f32) + within);
        radiance(scene, ray, &rng, params.max_depth, params.flags & PATH_ROULETTE != 0)
    })
}

/// An estimate of the radiance that arrives along `ray`, over paths of up to `max_depth` segments.
pub fn radiance<S: Trace + Surface + Lights>(scene: &S, ray: Ray, rng: &Rng, max_depth: u32, roulette: bool) -> Vec3 {
    let mut ray = ray;
    let mut sum = Vec3::ZERO;
    let mut throughput = Vec3::ONE;
    // density per steradian with which the last vertex chose `ray`; unused for the first segment
    let mut scatter_pdf = 0.0;
    let mut depth = 0;
    let mut alive = depth < max_depth;
    while alive {
        let hit = scene.closest(&ray);
        alive = hit.is_hit();
        if hit.is_cut() {
            sum = CUT;
        }
        if alive {
            let point = scene.surface(&ray, &hit);
            let weight = if depth == 0 {
                1.0
            } else {
                emission_weight(scene.light_density(&hit), &point, &ray, hit.t, scatter_pdf)
            };
            sum += throughput * point.emission * weight;
            depth += 1;
            alive = depth < max_depth && max_component(throughput) > 0.0;
            if alive {
                let dimension = FIRST_DIMENSION + (depth - 1).wrapping_mul(DIMENSIONS_PER_SEGMENT);
                let vertex = Vertex::new(&point, &ray);
                let light = scene.sample_light(rng.draw(dimension + LIGHT));
                let next_event = vertex.next_event(&light);
                if max_component(next_event.value) > 0.0 && !scene.occluded(&next_event.shadow) {
                    sum += throughput * next_event.value;
                }
                let words = rng.draw(dimension + SCATTER);
                let scattered = vertex.bsdf.sample(Vec2::new(rng::unit(words.x), rng::unit(words.y)));
                scatter_pdf = scattered.pdf;
                throughput = flush(throughput * scattered.weight);
                ray = vertex.spawn(vertex.frame.to_world(scattered.direction));
                if roulette && depth >= ROULETTE_FROM {
                    let survival = num::clamp(max_component(throughput), MIN_SURVIVAL, 1.0);
                    alive = rng::unit(words.z) < survival;
                    throughput *= num::recip(survival);
                }
                // a direction in the horizon carries nothing
                alive = alive && scatter_pdf > 0.0;
            }
        }
    }
    if alive { CUT } else { sum }
}

/// Named point of flushing: magnitudes below 2^-100 are zero.
#[inline(always)]
fn flush(v: Vec3) -> Vec3 {
    Vec3::new(num::flush(v.x), num::flush(v.y), num::flush(v.z))
}

/// The weight of emission that scattering found: its density over the sum of both strategies' densities.
#[inline(always)]
fn emission_weight(light_density: f32, point: &SurfacePoint, ray: &Ray, t: f32, scatter_pdf: f32) -> f32 {
    // the light's density per steradian is light_density t^2 / cos; multiplied out, so that cos may be zero
    let scatter = scatter_pdf * num::abs(dot(point.normal, ray.direction));
    let light = light_density * (t * t);
    if scatter > 0.0 { num::div(scatter, scatter + light) } else { 0.0 }
}

/// A vertex of a path, seen from the side that the path came from.
struct Vertex {
    position: Vec3,
    offset: f32,
    frame: Frame,
    bsdf: Lambert,
}

/// Light from a sampled point, weighted, if nothing lies on the segment.
struct NextEvent {
    value: Vec3,
    shadow: Ray,
}

impl Vertex {
    #[inline(always)]
    fn new(point: &SurfacePoint, ray: &Ray) -> Self {
        let normal = if dot(point.normal, ray.direction) > 0.0 { -point.normal } else { point.normal };
        Self {
            position: point.position,
            offset: point.offset,
            frame: Frame::new(normal),
            bsdf: Lambert { reflectance: point.reflectance },
        }
    }

    #[inline(always)]
    fn origin(&self) -> Vec3 {
        self.position + self.frame.n * self.offset
    }

    #[inline(always)]
    fn spawn(&self, direction: Vec3) -> Ray {
        Ray { origin: self.origin(), direction, t_max: Ray::FAR }
    }

    /// The balance heuristic's weight is folded in: with w = l / (l + s), the value f cos L / l times w is
    /// f cos L / (l + s), where l and s are the densities per steradian of the light and of scattering.
    #[inline(always)]
    fn next_event(&self, light: &LightSample) -> NextEvent {
        let origin = self.origin();
        let to_light = light.position - origin;
        let facing = dot(light.normal, to_light) < 0.0;
        let side = if facing { light.offset } else { -light.offset };
        let shadow = Ray { origin, direction: (light.position + light.normal * side) - origin, t_max: 1.0 };
        let distance_squared = dot(to_light, to_light);
        let cos_scaled = dot(self.frame.n, to_light);
        let emits = light.density > 0.0 && (facing || light.two_sided);
        if !(emits && cos_scaled > 0.0 && distance_squared > MIN_DISTANCE_SQUARED) {
            return NextEvent { value: Vec3::ZERO, shadow };
        }
        let inv_distance = num::rsqrt(distance_squared);
        let cos = cos_scaled * inv_distance;
        let cos_light = num::abs(dot(light.normal, to_light)) * inv_distance;
        let light_scaled = light.density * distance_squared;
        let scatter_scaled = self.bsdf.pdf(cos) * cos_light;
        let value =
            flush(light.emission * self.bsdf.eval_cos(cos)) * num::div(cos_light, light_scaled + scatter_scaled);
        NextEvent { value, shadow }
    }
}

/// Points closer than 2^-40 count as the same: no light passes between them.
const MIN_DISTANCE_SQUARED: f32 = 8.271_806e-25;
