//! The points of a profile, and the light that enters at them.

use super::exit::Exit;
use super::params::*;
use super::profile::EntryProfile;
use super::record::{Entry, PackedEntry, PackedExit};
use super::segment::Segment;
use crate::bsdf::Material;
use crate::film::CUT;
use crate::geometry::{Crossings, Hit, Ray};
use crate::layout::FilmPixel;
use crate::num;
use crate::rng::{self, Rng};
use crate::scene::{Lights, Probe, Surface, SurfacePoint, Trace};
use crate::technique::path::{PathFlags, Walk};
use crate::transport::{Chosen, Connection, Vertex, next_event};
use crate::vec::{max_abs, max_component};
use glam::Vec3;

/// One of several points, in proportion to what they are worth: the path that goes on from it.
struct Choice {
    walk: Walk,
    alive: bool,
    worth: f32,
    /// Of all points.
    sum: f32,
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
    let profile = EntryProfile::new(&params.fit(), &at, (&interior, scene.absorbed(&entry.hit)), entry.travelled);
    let one = params.has(PathFlags::ONE_CROSSING);
    let outside = entry.throughput * entry.gain;
    let per_segment = num::recip(params.segments as f32);
    let (mut sum, mut cut) = (Vec3::ZERO, false);
    let mut segment = 0;
    while (segment < params.segments) & !cut {
        let drawn = Segment::new(rng, segment);
        let chances = drawn.chances();
        let ray = profile.disk.segment(&profile.numbers(drawn.words(), segment, per_segment));
        let key = Ray::random_key(scene.features(), chances.y);
        let crossings = scene.probe(&Ray { key, ..ray }, interior.body);
        cut = crossings.is_cut();
        let each = per_segment * if one { crossings.count as f32 } else { 1.0 };
        let chosen = crossings.one_of(rng::unit(chances.x));
        let mut index = 0;
        while (index <= Crossings::LISTED) & !cut {
            // the last is the entry, where channels are Lambertian
            let lambert = index == Crossings::LISTED;
            let listed = if lambert { entry.hit } else { crossings.listed(index) };
            let hit = if one & !lambert { only(chosen, index) } else { listed };
            if hit.is_hit() {
                let point = scene.location(&hit);
                let worth = profile.worth(point.position, point.normal) * each;
                let worth = outside * if lambert { profile.lambert * per_segment } else { worth };
                if max_abs(worth) > 0.0 {
                    let any = Ray { direction: at.normal, ..Ray::NONE };
                    let dimension = drawn.of_point(index as u32);
                    sum += self::light(scene, params, (&scene.surface(&any, &hit), worth), rng, dimension, choice);
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
    let vertex = Exit::vertex(point, features);
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
