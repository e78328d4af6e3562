//! Path tracing: next-event estimation and BSDF sampling, joined by the balance heuristic (Veach 1997, §9.2).

use crate::bsdf::Bsdf;
use crate::camera::{has_lens, primary_ray};
use crate::film::sum_block;
use crate::geometry::Ray;
use crate::layout::{FEATURE_SHADING, FEATURE_VOLUME, FilmPixel, PATH_JITTER, PATH_ROULETTE, PathParams};
use crate::num;
use crate::rng::{self, Rng};
use crate::sampling::sample_concentric_disk;
use crate::scene::{LightKind, LightSample, Lights, Surface, SurfacePoint, Trace};
use crate::vec::{Frame, dot, max_component, normalize};
use glam::{Vec2, Vec3};

/// Random dimensions: one for the camera, then [`DIMENSIONS_PER_SEGMENT`] a segment, used or not, so that a
/// decision keeps its numbers whatever was decided before it.
const CAMERA_DIMENSION: u32 = 0;
const FIRST_DIMENSION: u32 = 1;
const DIMENSIONS_PER_SEGMENT: u32 = 3;
const LIGHT: u32 = 0;
const SCATTER: u32 = 1;
const ROULETTE: u32 = 2;
/// Roulette leaves paths of up to three segments alone.
const ROULETTE_FROM: u32 = 3;
const MIN_SURVIVAL: f32 = 0.05;
/// The radiance of a sample that a device which limits loops has cut short: beyond what the film accepts, so that it
/// is dropped and counted.
const CUT: Vec3 = Vec3::splat(f32::MAX);
/// Shading normals are bent towards the viewer until the cosine to it is this, or the geometric normal's if that is less.
const MIN_SHADING_COS: f32 = 0.01;
/// Points closer than 2^-40 count as the same: no light passes between them.
const MIN_DISTANCE_SQUARED: f32 = 8.271_806e-25;

/// The sum of one block of samples of the pixel (x, y).
pub fn pixel<S: Trace + Surface + Lights>(scene: &S, params: &PathParams, x: u32, y: u32) -> FilmPixel {
    sum_block(params.first_sample, params.block_log2, |sample| {
        let rng = Rng::new(x, y, sample, params.seed);
        let ray = camera_ray(params, &rng, x, y);
        radiance(scene, ray, &rng, params.max_depth, params.flags & PATH_ROULETTE != 0)
    })
}

/// The camera's ray of a sample of the pixel (x, y).
#[inline(always)]
pub fn camera_ray(params: &PathParams, rng: &Rng, x: u32, y: u32) -> Ray {
    let words = rng.draw(CAMERA_DIMENSION);
    let within = if params.flags & PATH_JITTER != 0 {
        Vec2::new(rng::unit(words.x), rng::unit(words.y))
    } else {
        Vec2::splat(0.5)
    };
    let lens = if has_lens(&params.camera) {
        sample_concentric_disk(Vec2::new(rng::unit(words.z), rng::unit(words.w)))
    } else {
        Vec2::ZERO
    };
    primary_ray(&params.camera, Vec2::new(x as f32, y as f32) + within, lens)
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
                    let next_event = vertex.next_event(&light);
                    if max_component(next_event.value) > 0.0 && !scene.occluded(&next_event.shadow) {
                        sum += throughput * next_event.value;
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

/// Named point of flushing: magnitudes below 2^-100 are zero.
#[inline(always)]
fn flush(v: Vec3) -> Vec3 {
    Vec3::new(num::flush(v.x), num::flush(v.y), num::flush(v.z))
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

/// A vertex of a path, seen from the side that the path came from.
struct Vertex {
    position: Vec3,
    offset: f32,
    /// Geometric normal on that side.
    normal: Vec3,
    /// Around the shading normal on that side.
    frame: Frame,
    bsdf: Bsdf,
}

/// Light from a sampled point, weighted, if nothing lies on the segment.
struct NextEvent {
    value: Vec3,
    shadow: Ray,
}

impl Vertex {
    #[inline(always)]
    fn new(point: &SurfacePoint, ray: &Ray, features: u32) -> Self {
        let front = dot(point.normal, ray.direction) <= 0.0;
        let wo = -ray.direction;
        let normal = if front { point.normal } else { -point.normal };
        let shading = if features & FEATURE_SHADING != 0 {
            facing(if front { point.shading_normal } else { -point.shading_normal }, normal, wo)
        } else {
            normal
        };
        let frame = Frame::new(shading);
        Self {
            position: point.position,
            offset: point.offset,
            normal,
            frame,
            bsdf: Bsdf::new(&point.material, frame.to_local(wo), front, features),
        }
    }

    /// Where a ray in the given direction leaves from: on the side that it goes to.
    #[inline(always)]
    fn origin(&self, direction: Vec3) -> Vec3 {
        let offset = if dot(self.normal, direction) < 0.0 { -self.offset } else { self.offset };
        self.position + self.normal * offset
    }

    /// Whether a direction lies on the same side of the surface as of the shading frame. Others would leak through
    /// the surface; they carry nothing, whoever chooses them.
    #[inline(always)]
    fn is_consistent(&self, direction: Vec3, local: Vec3) -> bool {
        (dot(self.normal, direction) < 0.0) == (local.z < 0.0)
    }

    /// The balance heuristic's weight is folded in: with w = l / (l + s), the value f cos L / l times w is
    /// f cos L / (l + s), where l and s are the densities per steradian of the light and of scattering.
    #[inline(always)]
    fn next_event(&self, light: &LightSample) -> NextEvent {
        let far = light.at_infinity();
        let origin = self.origin(if far { light.position } else { light.position - self.position });
        let to_light = if far { light.position } else { light.position - origin };
        let facing = dot(light.normal, to_light) < 0.0;
        let side = if facing { light.offset } else { -light.offset };
        let target = if far { to_light } else { (light.position + light.normal * side) - origin };
        let shadow = Ray { origin, direction: target, t_max: if far { Ray::FAR } else { 1.0 } };
        let distance_squared = if far { 1.0 } else { dot(to_light, to_light) };
        let emits = (light.density > 0.0) & ((light.kind != LightKind::Area) | facing | light.two_sided);
        if !(emits & (distance_squared > MIN_DISTANCE_SQUARED)) {
            return NextEvent { value: Vec3::ZERO, shadow };
        }
        let inv_distance = if far { 1.0 } else { num::rsqrt(distance_squared) };
        let wi = to_light * inv_distance;
        let local = self.frame.to_local(wi);
        let axis_cos = -dot(light.normal, wi);
        let cos_light = if light.kind == LightKind::Area { num::abs(axis_cos) } else { 1.0 };
        let falloff = if light.kind == LightKind::Point { light.spot_falloff(axis_cos) } else { 1.0 };
        let scattered = self.bsdf.evaluate(local);
        let scatter_scaled = if light.is_punctual() { 0.0 } else { scattered.pdf * cos_light };
        let value = flush(light.emission * falloff * scattered.value)
            * num::div(cos_light, light.density * distance_squared + scatter_scaled);
        NextEvent { value: if self.is_consistent(wi, local) { value } else { Vec3::ZERO }, shadow }
    }
}

/// A shading normal bent towards the viewer, if it turns away from it. The geometric normal itself stays as it is.
#[inline(always)]
fn facing(shading: Vec3, geometric: Vec3, wo: Vec3) -> Vec3 {
    let cos = dot(shading, wo);
    let least = num::min(MIN_SHADING_COS, dot(geometric, wo));
    if cos < least { normalize(shading + wo * (least - cos)) } else { shading }
}
