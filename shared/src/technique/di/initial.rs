//! Initial candidates.

use super::pixel::Pixel;
use super::stored::Stored;
use super::{CANDIDATE_DIMENSION, SCATTER_DIMENSION, evaluate};
use crate::geometry::Ray;
use crate::layout::{DI_FINAL_RAY, DI_INITIAL_VISIBILITY, DI_SCATTER_CANDIDATE, DiParams, FilmPixel};
use crate::num;
use crate::reservoir::Reservoir;
use crate::rng::{self, Rng};
use crate::scene::{AddressedLights, LightAddress, Surface, Trace};
use crate::technique::path::CUT;
use crate::technique::vertex::Vertex;
use glam::{UVec4, Vec3};

/// An address in a stream of candidates.
#[derive(Clone, Copy)]
struct Candidate {
    address: LightAddress,
    target: f32,
    /// Index in the stream; the one after the lights' is scattering's.
    index: u32,
    shadow: Ray,
}

/// What scattering finds.
struct Scattered {
    address: LightAddress,
    /// Light by way of a perfect lobe, weighted.
    radiance: Vec3,
}

/// The reservoir of the pixel (x, y), packed, and the radiance that needs no resampling: what is seen to emit, and what
/// perfect lobes show, as a film's sample.
///
/// One RIS over all candidates: with the balance heuristic each has the weight `p / sum n_t p_t`, whatever technique t
/// gave it (Veach 1997, eq. 9.8, in Talbot's form). Densities are over (light, u, v). The reservoir's confidence is 1.
pub fn initial<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &DiParams,
    flags: u32,
    hit: UVec4,
    at: [u32; 2],
) -> (UVec4, FilmPixel) {
    let (reservoir, direct, _) = initial_from(scene, params, flags, hit, at);
    (reservoir, direct)
}

/// As [`initial`], with the index of the candidate that the reservoir keeps, if it has a sample: those from lights come first,
/// then the one from scattering.
#[inline(always)]
pub fn initial_from<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &DiParams,
    flags: u32,
    hit: UVec4,
    [x, y]: [u32; 2],
) -> (UVec4, FilmPixel, u32) {
    let pixel = Pixel::new(&params.camera, flags, params.seed, params.frame, [x, y], hit);
    if !pixel.hit.is_hit() {
        let radiance = if pixel.hit.is_cut() { CUT } else { scene.environment(pixel.ray.direction).radiance };
        return (Stored::EMPTY.pack(), FilmPixel::from_radiance(radiance), 0);
    }
    let rng = Rng::new(x, y, params.frame, params.seed);
    let point = pixel.point(scene);
    let vertex = Vertex::new(&point, &pixel.ray, scene.features());
    let scattered = scatter(scene, &vertex, flags, rng.draw(SCATTER_DIMENSION));
    let reservoir = stream(scene, params, flags, &vertex, &scattered, &rng);
    let kept = reservoir.sample;
    let asks = flags & DI_INITIAL_VISIBILITY != 0 || flags & DI_FINAL_RAY == 0;
    // what scattering has found is visible
    let seen = kept.index == params.candidates;
    let traced = asks & !seen & (kept.target > 0.0);
    let visible = !(traced && scene.occluded(&kept.shadow));
    let lost = !visible & (flags & DI_INITIAL_VISIBILITY != 0);
    let stored = Stored {
        address: kept.address,
        contribution_weight: if lost { 0.0 } else { reservoir.contribution_weight(1.0, kept.target) },
        confidence: 1.0,
        visibility: if visible { 1.0 } else { 0.0 },
    };
    (stored.pack(), FilmPixel::from_radiance(point.emission + scattered.radiance), kept.index)
}

/// Follows one direction of scattering.
#[inline(always)]
fn scatter<S: Trace + Surface + AddressedLights>(scene: &S, vertex: &Vertex, flags: u32, words: UVec4) -> Scattered {
    let sample = vertex.bsdf.sample(words);
    let direction = vertex.frame.to_world(sample.direction);
    let mut scattered = Scattered { address: LightAddress::NONE, radiance: Vec3::ZERO };
    let wanted = sample.delta | (flags & DI_SCATTER_CANDIDATE != 0);
    if wanted & (sample.pdf > 0.0) & vertex.is_consistent(direction, sample.direction) {
        let ray = Ray { origin: vertex.origin(direction), direction, t_max: Ray::FAR };
        let hit = scene.closest(&ray);
        if hit.is_cut() {
            scattered.radiance = CUT;
        } else if sample.delta {
            let seen =
                if hit.is_hit() { scene.surface(&ray, &hit).emission } else { scene.environment(direction).radiance };
            scattered.radiance = sample.weight * seen;
        } else if hit.is_hit() {
            scattered.address = scene.address_of_hit(&hit);
        } else {
            scattered.address = scene.address_of_environment(direction);
        }
    }
    scattered
}

#[inline(always)]
fn stream<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &DiParams,
    flags: u32,
    vertex: &Vertex,
    scattered: &Scattered,
    rng: &Rng,
) -> Reservoir<Candidate, f32> {
    let none = Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: Ray::FAR };
    let mut reservoir =
        Reservoir::empty(Candidate { address: LightAddress::NONE, target: 0.0, index: 0, shadow: none });
    let from_lights = params.candidates as f32;
    let from_scattering = if flags & DI_SCATTER_CANDIDATE != 0 { 1.0 } else { 0.0 };
    let count = if vertex.bsdf.has_smooth_part() { params.candidates.wrapping_add(1) } else { 0 };
    let mut i = 0;
    while i < count {
        let dimension = CANDIDATE_DIMENSION.wrapping_add(i.wrapping_mul(2));
        let address =
            if i == params.candidates { scattered.address } else { scene.choose_address(rng.draw(dimension)) };
        if address.is_light() {
            let e = evaluate(scene, flags, vertex, address);
            let density = from_lights * e.light_density + from_scattering * e.scatter_density;
            let weight =
                if (e.target > 0.0) & (density > num::FLUSH_BELOW) { num::div(e.target, density) } else { 0.0 };
            let u = rng::unit(rng.draw(dimension.wrapping_add(1)).x);
            let candidate = Candidate { address, target: e.target, index: i, shadow: e.shadow };
            reservoir.update(candidate, weight, 1.0, u);
        }
        i = i.wrapping_add(1);
    }
    reservoir
}
