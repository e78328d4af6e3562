//! The points of a profile, and the light that enters at them.

use super::exit::Exit;
use super::params::*;
use super::record::{Entry, PackedEntry, PackedExit};
use crate::bsdf::Material;
use crate::diffusion::{Disk, DiskNumbers, Multiple, Profile};
use crate::film::CUT;
use crate::geometry::{Crossings, Hit, Ray};
use crate::layout::FilmPixel;
use crate::medium::{Interior, Medium};
use crate::num;
use crate::rng::{self, Rng};
use crate::scene::{Lights, Location, Probe, Surface, SurfacePoint, Trace};
use crate::technique::path::{PathFlags, Walk};
use crate::transport::{Chosen, Connection, Vertex, next_event};
use crate::vec::{length, max_abs, max_component};
use glam::{UVec4, Vec3, Vec4};

/// Random dimensions of the first segment, and how many each has: its own, of the choice of points, and of each point a light and a
/// direction.
const SEGMENTS: u32 = 1 << 23;
const PER_SEGMENT: u32 = 64;
const CHOICE: u32 = 1;
const POINTS: u32 = 8;
const _: () = assert!(POINTS + 2 * (Crossings::LISTED as u32 + 1) <= PER_SEGMENT);

/// What a profile is at an entry.
struct Gathering {
    disk: Disk,
    rest: [Multiple; 3],
    extinction: Vec3,
    /// Reflectance of the channels that are Lambertian.
    lambert: Vec3,
}

/// One of several points, in proportion to what they are worth: the path that goes on from it.
struct Choice {
    walk: Walk,
    alive: bool,
    worth: f32,
    /// Of all points.
    sum: f32,
}

impl Gathering {
    #[inline(always)]
    fn new(params: &HybridParams, at: &Location, (interior, absorbed): (&Interior, Vec3), travelled: f32) -> Self {
        let medium = interior.medium(absorbed);
        let kept = params.spread(interior, travelled);
        let profile = Profile::of_medium(&medium, params.shape()).of_channels(kept);
        let profile = if params.has(PathFlags::BY_ALBEDO) { profile.chosen_by_albedo() } else { profile };
        let disk = Disk { support: params.support(), ..Disk::new(at.position, at.normal, profile) };
        let Medium { albedo, absorbed, extinction, anisotropy } = medium;
        let rest = |albedo: f32, absorbed: f32| Multiple::new(albedo, absorbed, anisotropy, params.remainder());
        Self {
            disk,
            rest: [rest(albedo.x, absorbed.x), rest(albedo.y, absorbed.y), rest(albedo.z, absorbed.z)],
            extinction,
            lambert: medium.color() * (Vec3::ONE - kept),
        }
    }

    /// One of several segments. The axes are spread over them: of two the first is along the normal.
    #[inline(always)]
    fn segment(&self, words: UVec4, index: u32, per_segment: f32) -> Ray {
        let unit = rng::unit;
        // the words that are spread best make the point of the disk
        let axis = (index as f32 + unit(words.z)) * per_segment;
        let numbers = Vec4::new(axis, unit(words.w), unit(words.x), unit(words.y));
        self.disk.segment(&DiskNumbers::new(numbers, &self.disk.profile))
    }

    /// What a point of the segment is worth: the profile over the density.
    #[inline(always)]
    fn worth(&self, params: &HybridParams, position: Vec3, normal: Vec3) -> Vec3 {
        let (weight, _) = self.disk.weight(position, normal);
        let x = self.extinction * length(position - self.disk.centre);
        let share = Vec3::new(self.rest[0].share(x.x), self.rest[1].share(x.y), self.rest[2].share(x.z));
        if params.has(PathFlags::WHOLE) { weight } else { weight * share }
    }
}

/// What a path leaves beside a body.
#[derive(Debug)]
pub struct Gathered {
    /// The path that goes on from a point of the profile.
    pub exit: PackedExit,
    /// The sample so far.
    pub sample: FilmPixel,
}

/// Adds the profile's light to the sample of a path that waits at an entry, and lets it go on from one of the profile's points.
pub fn gather<S: Trace + Surface<Material = Material> + Lights + Probe>(
    scene: &S,
    params: &HybridParams,
    packed: PackedEntry,
    pixel: [u32; 2],
) -> Gathered {
    let entry = packed.entry();
    let rng = params.rng(pixel);
    let mut choice = Choice { walk: Walk::new(Ray::NONE), alive: false, worth: 0.0, sum: 0.0 };
    let mut radiance = packed.radiance();
    if params.has(PathFlags::PROFILE) & (entry.depth + 1 < params.path.max_depth) {
        radiance += points(scene, params, &entry, &rng, &mut choice);
    }
    let each = if choice.alive { num::div(choice.sum, choice.worth) } else { 0.0 };
    let walk = Walk { throughput: choice.walk.throughput * each, depth: entry.depth + 1, ..choice.walk };
    Gathered { exit: PackedExit::new(&walk, choice.alive, radiance), sample: FilmPixel::from_radiance(radiance) }
}

/// The light of lights at the points of all segments.
#[inline(always)]
fn points<S: Trace + Surface<Material = Material> + Lights + Probe>(
    scene: &S,
    params: &HybridParams,
    entry: &Entry,
    rng: &Rng,
    choice: &mut Choice,
) -> Vec3 {
    let (at, interior) = (scene.location(&entry.hit), scene.interior(&entry.hit));
    let gathering = Gathering::new(params, &at, (&interior, scene.absorbed(&entry.hit)), entry.travelled);
    let one = params.has(PathFlags::ONE_CROSSING);
    let outside = entry.throughput * entry.gain;
    let per_segment = num::recip(params.segments as f32);
    let (mut sum, mut cut) = (Vec3::ZERO, false);
    let mut segment = 0;
    while (segment < params.segments) & !cut {
        let first = SEGMENTS + segment * PER_SEGMENT;
        let chances = rng.hash(first + CHOICE);
        let ray = gathering.segment(rng.draw(first), segment, per_segment);
        let key = Ray::random_key(scene.features(), chances.y);
        let crossings = scene.probe(&Ray { key, ..ray }, interior.body);
        cut = crossings.is_cut();
        let each = per_segment * if one { crossings.count as f32 } else { 1.0 };
        let chosen = crossings.one_of(rng::unit(chances.x));
        let mut index = 0;
        while (index <= Crossings::LISTED) & !cut {
            // the last is the entry, where channels are Lambertian
            let lambert = index == Crossings::LISTED;
            let listed = if lambert { entry.hit } else { crossings.nearest[index] };
            let hit = if one & !lambert { only(chosen, index) } else { listed };
            if hit.is_hit() {
                let any = Ray { direction: at.normal, ..Ray::NONE };
                let point = scene.surface(&any, &hit);
                let worth = gathering.worth(params, point.position, point.normal) * each;
                let worth = outside * if lambert { gathering.lambert * per_segment } else { worth };
                if max_abs(worth) > 0.0 {
                    let dimension = first + POINTS + 2 * index as u32;
                    sum += self::light(scene, params, (&point, worth), rng, dimension, choice);
                }
            }
            index += 1;
        }
        segment += 1;
    }
    if cut { CUT } else { sum }
}

/// A hit as the only one of a list.
#[inline(always)]
fn only(hit: Hit, index: usize) -> Hit {
    if index == 0 { hit } else { Hit::MISS }
}

/// The light of a light at a point of the surface, of which light that becomes diffuse there is worth `worth`; the point may become that
/// from which the path goes on. No other function asks for light at an exit of a profile: another estimate of it belongs here.
#[inline(always)]
fn light<S: Trace + Surface<Material = Material> + Lights>(
    scene: &S,
    params: &HybridParams,
    (point, worth): (&SurfacePoint, Vec3),
    rng: &Rng,
    dimension: u32,
    choice: &mut Choice,
) -> Vec3 {
    let features = scene.features();
    let SurfacePoint { position, normal, shading_normal, offset, emission, absorption, .. } = *point;
    let material = Exit::new(&point.material, features);
    let exit = SurfacePoint { position, normal, shading_normal, offset, material, emission, absorption };
    let outside = Ray { direction: -normal, ..Ray::NONE };
    let vertex: Vertex<Exit> = Vertex::new(&exit, &outside, features);
    if params.has(PathFlags::GOES_ON) {
        choice.offer(&vertex, worth, rng, dimension + 1, features);
    }
    let sample = scene.sample_light(rng.draw(dimension));
    let connection = vertex.connect(&sample);
    if max_component(connection.value) <= 0.0 || scene.occluded(&connection.shadow) {
        return Vec3::ZERO;
    }
    // without a path that goes on nothing else finds the light
    if params.has(PathFlags::GOES_ON) {
        worth * next_event(sample.density, &connection)
    } else {
        let Connection { value, cos_light, distance_squared, .. } = connection;
        worth * value * num::div(cos_light, sample.density * distance_squared)
    }
}

impl Choice {
    /// Takes the point in the place of the one before, in proportion to what both are worth.
    #[inline(always)]
    fn offer(&mut self, vertex: &Vertex<Exit>, worth: Vec3, rng: &Rng, dimension: u32, features: u32) {
        let words = rng.draw(dimension);
        let departure = vertex.depart(words, features);
        let weight = max_abs(worth);
        self.sum += weight;
        if rng::unit(words.z) * self.sum < weight {
            let chosen = Chosen { pdf: departure.sample.pdf, alone: false };
            let throughput = worth * departure.sample.weight;
            self.walk = Walk { ray: departure.ray, throughput, chosen, depth: 0 };
            self.alive = departure.alive;
            self.worth = weight;
        }
    }
}
