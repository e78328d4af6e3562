//! Initial samples: of all points that a pixel's segments find, one with its light.

use super::evaluate::evaluate;
use super::origin::{Entrance, SssOrigin};
use super::record::{Kind, PackedSubsurface, Sample, Stored};
use super::{SELECTIONS, SssParams};
use crate::bsdf::Material;
use crate::film::CUT;
use crate::geometry::{Hit, PackedHit, Ray};
use crate::num;
use crate::resample::mutual::Record;
use crate::resample::params::Flags;
use crate::resample::reservoir::Reservoir;
use crate::resample::similar::{GBufferSurface, PackedSurface};
use crate::rng::{self, Rng};
use crate::scene::{AddressedLights, LightAddress, Probe, Surface, Trace};
use crate::technique::path::PathFlags;
use crate::technique::path::hybrid::{ENTRY, Entry, Found, PackedEntry, Points, Segment};
use crate::transport::shadow_ray;
use crate::vec::{length, max_abs};
use glam::Vec3;

/// What a pixel's entry gives.
#[derive(Clone, Copy, Debug)]
pub struct Initial {
    /// Where all samples of the pixel begin.
    pub origin: SssOrigin,
    /// The surface there.
    pub surface: PackedSurface,
    /// One of its candidates, chosen in proportion to its target, of a confidence of 1; it has no weight if nothing arrives from its light.
    pub reservoir: PackedSubsurface,
}

/// A candidate, as little of it as has to be kept while others are looked at.
#[derive(Clone, Copy)]
struct Candidate {
    hit: Hit,
    /// Which of the pixel's segments has found it, and which of its hits it is.
    segment: u32,
    crossing: u32,
    light: LightAddress,
    kind: Kind,
    partial_jacobian: f32,
    value: Vec3,
    shadow: Ray,
}

impl Candidate {
    const NONE: Self = Self {
        hit: Hit::MISS,
        segment: 0,
        crossing: 0,
        light: LightAddress::NONE,
        kind: Kind::Kept,
        partial_jacobian: 1.0,
        value: Vec3::ZERO,
        shadow: Ray::NONE,
    };
}

/// Looks for points of the profile where the path of the pixel `at` enters a body, draws a light for each, and keeps one.
#[inline(always)]
pub fn initial<S: Trace + Surface<Material = Material> + AddressedLights + Probe>(
    scene: &S,
    params: &SssParams,
    entry: PackedEntry,
    at: [u32; 2],
) -> Initial {
    let entry = entry.entry();
    let Entry { hit, throughput, gain, depth, travelled, alive, .. } = entry;
    if !alive | (depth + 1 >= params.max_depth) {
        let reservoir = PackedSubsurface::default();
        return Initial { origin: SssOrigin::NONE, surface: PackedSurface::NONE, reservoir };
    }
    let of_half_space = SssOrigin { hit: PackedHit::pack(&hit), throughput: (throughput * gain).to_array(), travelled };
    let (entrance, throughput) = Entrance::new(scene, params, &of_half_space, false).kept(scene, &entry);
    let origin = SssOrigin { throughput: throughput.to_array(), ..of_half_space };
    let distance = length(entrance.at.position - Vec3::from_array(params.camera.position));
    let surface = GBufferSurface { position: entrance.at.position, normal: entrance.at.normal, distance };
    let reservoir = candidates(scene, params, &entrance, &params.rng(at));
    Initial { origin, surface: PackedSurface::pack(&surface), reservoir }
}

/// One candidate of all.
#[inline(always)]
fn candidates<S: Trace + Surface<Material = Material> + AddressedLights + Probe>(
    scene: &S,
    params: &SssParams,
    entrance: &Entrance,
    rng: &Rng,
) -> PackedSubsurface {
    let mut reservoir = Reservoir::empty(Candidate::NONE);
    let mut points = Points::new(params.segments, params.profile.contains(PathFlags::ONE_CROSSING));
    while points.go_on() {
        let found = points.next(scene, rng, &entrance.profile, (&entrance.hit, entrance.body));
        let (candidate, density) = draw(scene, params, entrance, &found, rng);
        let target = PackedSubsurface::target(candidate.value);
        let per_density = if density > 0.0 { num::div(found.each, density) } else { 0.0 };
        let dimension = SELECTIONS + found.segment * (ENTRY + 1) + found.turn;
        reservoir.update(candidate, target * per_density, 1.0, rng::unit(rng.hash(dimension).x));
    }
    if points.is_cut() {
        // no sample of any pixel is like it, and the film counts it
        let sample = Sample { hit: Hit::MISS, ..Sample::NONE };
        return Stored { sample, value: CUT, contribution_weight: 1.0, confidence: 1.0 }.pack();
    }
    let Candidate { hit, segment, crossing, light, kind, partial_jacobian, value, shadow } = reservoir.sample;
    let weight = reservoir.contribution_weight(1.0, PackedSubsurface::target(value));
    let numbers =
        entrance.profile.numbers(Segment::new(rng, segment).words(), segment, num::recip(params.segments as f32));
    let open = weight > 0.0 && !scene.occluded(&shadow);
    let sample = Sample { hit, light, numbers, crossing, kind, partial_jacobian };
    Stored { sample, value, contribution_weight: if open { weight } else { 0.0 }, confidence: 1.0 }.pack()
}

/// A found point with a light, and with which density both are drawn.
#[inline(always)]
fn draw<S: Surface<Material = Material> + AddressedLights>(
    scene: &S,
    params: &SssParams,
    entrance: &Entrance,
    found: &Found,
    rng: &Rng,
) -> (Candidate, f32) {
    let Found { hit, segment, crossing, .. } = *found;
    let none = Candidate { hit, segment, crossing, ..Candidate::NONE };
    if !hit.is_hit() {
        return (none, 0.0);
    }
    let at = scene.location(&hit);
    // what the profile says first, then the light: so that little is kept at a time
    let is_entry = crossing == ENTRY;
    let density = if is_entry { 1.0 } else { entrance.density(&at) };
    let worth = if is_entry { entrance.lambert() } else { entrance.worth(&at) };
    if max_abs(worth) <= 0.0 {
        return (none, 0.0);
    }
    let kind = if is_entry {
        Kind::AtEntry
    } else if params.replays(entrance.is_connectable(&at)) {
        Kind::Replayed
    } else {
        Kind::Kept
    };
    let is_replayed = kind == Kind::Replayed;
    let partial_jacobian = if is_replayed { entrance.partial_jacobian(&found.numbers, density) } else { 1.0 };
    let light = scene.choose_address(Segment::new(rng, segment).light(found.turn));
    let addressed = scene.light_at(light);
    let value = evaluate(scene, (&hit, &at), worth, &addressed);
    let value = if light.is_light() { value } else { Vec3::ZERO };
    let shadow = shadow_ray(&at, &addressed.sample);
    let density = density * (addressed.sample.density * addressed.extent);
    (Candidate { light, kind, partial_jacobian, value, shadow, ..none }, density)
}

impl SssParams {
    /// Whether a pass of these parameters replays a point that can be connected, or cannot.
    #[inline(always)]
    pub(super) fn replays(&self, connectable: bool) -> bool {
        self.has(Flags::DELAYED) & !(self.has(Flags::BY_CRITERION) & connectable)
    }
}
