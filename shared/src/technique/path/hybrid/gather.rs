//! The points of a profile, and the light that enters at them.

use super::exit::Exit;
use super::params::*;
use super::points::{ENTRY, Points};
use super::profile::EntryProfile;
use super::record::{Entry, PackedEntry, PackedExit};
use super::segment::Segment;
use crate::bsdf::Material;
use crate::film::CUT;
use crate::geometry::Ray;
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
    let outside = entry.throughput * entry.gain * profile.kept(scene, entry, (&at, interior.body));
    let mut points = Points::new(params.segments, params.has(PathFlags::ONE_CROSSING));
    let mut sum = Vec3::ZERO;
    while points.go_on() {
        let found = points.next(scene, rng, &profile, (&entry.hit, interior.body));
        if found.hit.is_hit() {
            let point = scene.location(&found.hit);
            let is_entry = found.crossing == ENTRY;
            let worth = if is_entry { profile.lambert } else { profile.worth(&point) };
            let worth = outside * (worth * found.each);
            if max_abs(worth) > 0.0 {
                let any = Ray { direction: at.normal, ..Ray::NONE };
                let dimension = Segment::new(rng, found.segment).of_point(found.turn);
                sum += self::light(scene, params, (&scene.surface(&any, &found.hit), worth), rng, dimension, choice);
            }
        }
    }
    if points.is_cut() { CUT } else { sum }
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
