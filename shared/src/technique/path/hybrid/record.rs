//! What of a path waits in planes, from one turn to the next.

use crate::diffusion::thickness;
use crate::geometry::{Hit, Ray};
use crate::num;
use crate::scene::{Location, Surface};
use crate::technique::path::Walk;
use crate::transport::{Chosen, GRAZING_COSINE};
use crate::vec::dot;
use bytemuck::{Pod, Zeroable};
use glam::{UVec4, Vec2, Vec3};

/// Where a path enters a body, where it would reach the border again, and what it has found before: 80 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct PackedEntry(pub [UVec4; 5]);

/// A path that goes on from a point of a profile, and what was found before: 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct PackedExit(pub [UVec4; 4]);

/// Bit of a path that has entered a body, or that goes on, beside its depth.
const ALIVE: u32 = 1 << 31;

/// Where a path enters a body.
#[derive(Clone, Copy)]
pub(crate) struct Entry {
    /// Without its distance.
    pub(crate) hit: Hit,
    /// In which it goes on inside, of unit length.
    pub(crate) direction: Vec3,
    /// What light inside is worth.
    pub(crate) throughput: Vec3,
    /// By how much refraction made radiance inside larger than outside; it is taken off `throughput` already.
    pub(crate) gain: f32,
    /// Segments that have ended on surfaces.
    pub(crate) depth: u32,
    /// How long the path is up to there.
    pub(crate) travelled: f32,
    /// What is hit inside in its direction, where that was asked.
    pub(crate) far: Hit,
    pub(crate) alive: bool,
}

#[inline(always)]
fn pack(v: Vec3, w: u32) -> UVec4 {
    UVec4::new(v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), w)
}

#[inline(always)]
fn vector(w: UVec4) -> Vec3 {
    Vec3::new(f32::from_bits(w.x), f32::from_bits(w.y), f32::from_bits(w.z))
}

#[inline(always)]
fn state(depth: u32, alive: bool) -> u32 {
    depth | if alive { ALIVE } else { 0 }
}

impl Entry {
    /// A path that enters nothing.
    pub(super) const NONE: Self = Self {
        hit: Hit::MISS,
        direction: Vec3::Z,
        throughput: Vec3::ZERO,
        gain: 1.0,
        depth: 0,
        travelled: 0.0,
        far: Hit::MISS,
        alive: false,
    };

    /// The ray across the body, from beside the surface where the path enters, without an end.
    #[inline(always)]
    pub(super) fn across(&self, at: &Location) -> Ray {
        Ray { origin: at.position - at.normal * at.offset, direction: self.direction, ..Ray::NONE }
    }

    /// How far from the surface that begins.
    #[inline(always)]
    pub(super) fn lead(&self, at: &Location) -> f32 {
        num::div(at.offset, num::max(num::abs(dot(at.normal, self.direction)), GRAZING_COSINE))
    }

    /// How thick the body is ([`thickness`]), as far as is known: [`Ray::FAR`] where something else lies inside.
    #[inline(always)]
    pub(crate) fn thickness<S: Surface>(&self, scene: &S, at: &Location, body: u32) -> f32 {
        if !self.far.is_hit() {
            return Ray::FAR;
        }
        let (far, met) = (scene.location(&self.far), scene.interior(&self.far));
        let leaves = (dot(far.normal, self.direction) > 0.0) & (met.body == body);
        if leaves { thickness(self.far.t + self.lead(at), dot(at.normal, far.normal)) } else { Ray::FAR }
    }
}

impl PackedEntry {
    #[inline(always)]
    pub(super) fn new(entry: &Entry, radiance: Vec3) -> Self {
        let Entry { hit, direction, throughput, gain, depth, travelled, far, alive } = *entry;
        Self([
            pack(radiance, state(depth, alive)),
            pack(throughput, hit.id),
            pack(direction, travelled.to_bits()),
            UVec4::new(hit.uv.x.to_bits(), hit.uv.y.to_bits(), gain.to_bits(), 0),
            UVec4::new(far.uv.x.to_bits(), far.uv.y.to_bits(), far.t.to_bits(), far.id),
        ])
    }

    #[inline(always)]
    pub(super) fn radiance(&self) -> Vec3 {
        vector(self.0[0])
    }

    /// Whether the path has entered a body.
    #[inline(always)]
    pub fn is_inside(&self) -> bool {
        self.0[0].w & ALIVE != 0
    }

    #[inline(always)]
    pub(crate) fn entry(&self) -> Entry {
        let [radiance, throughput, direction, place, far] = self.0;
        let far_uv = Vec2::new(f32::from_bits(far.x), f32::from_bits(far.y));
        let uv = Vec2::new(f32::from_bits(place.x), f32::from_bits(place.y));
        Entry {
            hit: Hit { t: Ray::FAR, id: throughput.w, uv },
            direction: vector(direction),
            throughput: vector(throughput),
            gain: f32::from_bits(place.z),
            depth: radiance.w & !ALIVE,
            travelled: f32::from_bits(direction.w),
            far: Hit { t: f32::from_bits(far.z), id: far.w, uv: far_uv },
            alive: self.is_inside(),
        }
    }
}

impl PackedExit {
    /// A path that goes on outside, if it is `alive`.
    #[inline(always)]
    pub(super) fn new(walk: &Walk, alive: bool, radiance: Vec3) -> Self {
        let Walk { ray, throughput, chosen, depth } = *walk;
        Self([
            pack(radiance, state(depth, alive)),
            pack(throughput, ray.key),
            pack(ray.origin, chosen.pdf.to_bits()),
            pack(ray.direction, 0),
        ])
    }

    #[inline(always)]
    pub(super) fn radiance(&self) -> Vec3 {
        vector(self.0[0])
    }

    /// Whether there is a path that goes on.
    #[inline(always)]
    pub(super) fn goes_on(&self) -> bool {
        self.0[0].w & ALIVE != 0
    }

    #[inline(always)]
    pub(super) fn walk(&self) -> Walk {
        let [radiance, throughput, origin, direction] = self.0;
        let ray = Ray { origin: vector(origin), direction: vector(direction), t_max: Ray::FAR, key: throughput.w };
        let chosen = Chosen { pdf: f32::from_bits(origin.w), alone: false };
        Walk { ray, throughput: vector(throughput), chosen, depth: radiance.w & !ALIVE }
    }
}
