//! What of a path waits in planes, from one turn to the next.

use crate::geometry::{Hit, Ray};
use crate::technique::path::Walk;
use crate::transport::Chosen;
use bytemuck::{Pod, Zeroable};
use glam::{UVec4, Vec2, Vec3};

/// Where a path enters a body, and what it has found before: 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct PackedEntry(pub [UVec4; 4]);

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
        alive: false,
    };
}

impl PackedEntry {
    #[inline(always)]
    pub(super) fn new(entry: &Entry, radiance: Vec3) -> Self {
        let Entry { hit, direction, throughput, gain, depth, travelled, alive } = *entry;
        Self([
            pack(radiance, state(depth, alive)),
            pack(throughput, hit.id),
            pack(direction, travelled.to_bits()),
            UVec4::new(hit.uv.x.to_bits(), hit.uv.y.to_bits(), gain.to_bits(), 0),
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
        let [radiance, throughput, direction, place] = self.0;
        let uv = Vec2::new(f32::from_bits(place.x), f32::from_bits(place.y));
        Entry {
            hit: Hit { t: Ray::FAR, id: throughput.w, uv },
            direction: vector(direction),
            throughput: vector(throughput),
            gain: f32::from_bits(place.z),
            depth: radiance.w & !ALIVE,
            travelled: f32::from_bits(direction.w),
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
