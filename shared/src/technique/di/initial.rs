//! Initial candidates.

use super::passage::{Passage, follow};
use super::pixel::Pixel;
use super::stored::{Stored, dithered};
use super::{CANDIDATE_DIMENSION, SCATTER_DIMENSION, evaluate, in_use};
use crate::bsdf::BsdfSample;
use crate::geometry::Ray;
use crate::layout::{DI_FINAL_RAY, DI_INITIAL_VISIBILITY, DI_SCATTER_CANDIDATE, DI_TRANSMITTANCE, DiParams, FilmPixel};
use crate::num;
use crate::reservoir::Reservoir;
use crate::rng::{self, Rng};
use crate::scene::{AddressedLights, LightAddress, Surface, Trace};
use crate::technique::path::CUT;
use crate::technique::vertex::Vertex;
use crate::vec::max_component;
use glam::{UVec4, Vec3};

/// An address in a stream of candidates.
#[derive(Clone, Copy)]
struct Candidate {
    address: LightAddress,
    target: f32,
    /// Scattering has found it.
    seen: bool,
    shadow: Ray,
}

impl Candidate {
    const NONE: Self = Self {
        address: LightAddress::NONE,
        target: 0.0,
        seen: false,
        shadow: Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: Ray::FAR },
    };
}

/// What scattering finds.
struct Scattered {
    address: LightAddress,
    /// What is left of its light on the way.
    transmittance: Vec3,
    /// Light by way of a perfect lobe, weighted.
    radiance: Vec3,
}

impl Scattered {
    const NOTHING: Self = Self { address: LightAddress::NONE, transmittance: Vec3::ONE, radiance: Vec3::ZERO };
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
    [x, y]: [u32; 2],
) -> (UVec4, FilmPixel) {
    let pixel = Pixel::new(&params.camera, flags, params.seed, params.frame, [x, y], hit);
    if !pixel.hit.is_hit() {
        let radiance = if pixel.hit.is_cut() { CUT } else { scene.environment(pixel.ray.direction).radiance };
        return (Stored::EMPTY.pack(), FilmPixel::from_radiance(radiance));
    }
    let flags = in_use(flags, scene);
    let rng = Rng::new(x, y, params.frame, params.seed);
    let point = pixel.point(scene);
    let vertex = Vertex::new(&point, &pixel.ray, scene.features());
    let sample = vertex.bsdf.sample(rng.draw(SCATTER_DIMENSION));
    let direction = vertex.frame.to_world(sample.direction);
    let wanted = sample.delta | (flags & DI_SCATTER_CANDIDATE != 0);
    let scatters = wanted & (sample.pdf > 0.0) & vertex.is_consistent(direction, sample.direction);
    let mut scattered = Scattered::NOTHING;
    let mut reservoir = Reservoir::empty(Candidate::NONE);
    let mut visibility = Vec3::ONE;
    // the ray of scattering, then the shadow ray of what is kept: in one place, for a way through glass takes much code
    let mut ray = Ray { origin: vertex.origin(direction), direction, t_max: Ray::FAR };
    let mut follows = scatters;
    let mut round = 0;
    while round < 2 {
        let passage = if follows { follow(scene, flags, &ray) } else { Passage::begin(&ray) };
        if round == 0 {
            if scatters {
                scattered = found(scene, &sample, &passage);
            }
            reservoir = stream(scene, params, flags, &vertex, &scattered, &rng);
            let kept = reservoir.sample;
            let asks = flags & DI_INITIAL_VISIBILITY != 0 || flags & DI_FINAL_RAY == 0;
            let traced = asks & !kept.seen & (kept.target > 0.0);
            visibility = if kept.seen { scattered.transmittance } else { Vec3::ONE };
            follows = traced & (flags & DI_TRANSMITTANCE != 0);
            ray = kept.shadow;
            if traced & !follows {
                visibility = if scene.occluded(&ray) { Vec3::ZERO } else { Vec3::ONE };
            }
        } else if follows {
            visibility = passage.arriving();
        }
        round += 1;
    }
    let kept = reservoir.sample;
    let lost = (max_component(visibility) <= 0.0) & (flags & DI_INITIAL_VISIBILITY != 0);
    let stored = Stored {
        address: kept.address,
        contribution_weight: if lost { 0.0 } else { reservoir.contribution_weight(1.0, kept.target) },
        confidence: 1.0,
        visibility: dithered(visibility, rng::unit(rng.draw(CANDIDATE_DIMENSION.wrapping_add(1)).y)),
    };
    (stored.pack(), FilmPixel::from_radiance(point.emission + scattered.radiance))
}

/// What the way of a scattered ray ends at.
#[inline(always)]
fn found<S: Surface + AddressedLights>(scene: &S, sample: &BsdfSample, passage: &Passage) -> Scattered {
    let Passage { hit, ray, transmittance } = passage;
    let mut scattered = Scattered { transmittance: *transmittance, ..Scattered::NOTHING };
    if hit.is_cut() {
        scattered.radiance = CUT;
    } else if sample.delta {
        let seen =
            if hit.is_hit() { scene.surface(ray, hit).emission } else { scene.environment(ray.direction).radiance };
        scattered.radiance = sample.weight * *transmittance * seen;
    } else if hit.is_hit() {
        scattered.address = scene.address_of_hit(hit);
    } else {
        scattered.address = scene.address_of_environment(ray.direction);
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
    let mut reservoir = Reservoir::empty(Candidate::NONE);
    let from_lights = params.candidates as f32;
    let from_scattering = if flags & DI_SCATTER_CANDIDATE != 0 { 1.0 } else { 0.0 };
    let count = if vertex.bsdf.has_smooth_part() { params.candidates.wrapping_add(1) } else { 0 };
    let mut i = 0;
    while i < count {
        let dimension = CANDIDATE_DIMENSION.wrapping_add(i.wrapping_mul(2));
        let seen = i == params.candidates;
        let address = if seen { scattered.address } else { scene.choose_address(rng.draw(dimension)) };
        if address.is_light() {
            let e = evaluate(scene, flags, vertex, address);
            let density = from_lights * e.light_density + from_scattering * e.scatter_density;
            let weight =
                if (e.target > 0.0) & (density > num::FLUSH_BELOW) { num::div(e.target, density) } else { 0.0 };
            let u = rng::unit(rng.draw(dimension.wrapping_add(1)).x);
            let candidate = Candidate { address, target: e.target, seen, shadow: e.shadow };
            reservoir.update(candidate, weight, 1.0, u);
        }
        i = i.wrapping_add(1);
    }
    reservoir
}
