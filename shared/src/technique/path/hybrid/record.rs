//! What of a path waits in a plane, from one turn to the next.

use crate::geometry::{Hit, Ray};
use crate::technique::path::Walk;
use crate::transport::Chosen;
use bytemuck::{Pod, Zeroable};
use glam::{UVec4, Vec2, Vec3};

/// Where a path enters a body, or where it goes on outside: 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct PackedEntry(pub [UVec4; 4]);

/// The path has entered a body.
const ENTERED: u32 = 1 << 31;
/// The path goes on outside.
const GOES_ON: u32 = 1 << 30;
const DEPTH: u32 = GOES_ON - 1;

/// Where a path enters a body.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    /// Without its distance.
    pub(super) hit: Hit,
    /// What light is worth that comes out there, as radiance outside over what refraction leaves of it.
    pub(super) throughput: Vec3,
    /// Segments that have ended on surfaces.
    pub(super) depth: u32,
    /// How long the path is up to there.
    pub(super) travelled: f32,
}

/// A path that goes on outside, and what was found before.
pub(super) struct Resumed {
    pub(super) walk: Walk,
    pub(super) radiance: Vec3,
    pub(super) alive: bool,
}

#[inline(always)]
fn pack(v: Vec3, w: u32) -> UVec4 {
    UVec4::new(v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), w)
}

#[inline(always)]
fn vector(w: UVec4) -> Vec3 {
    Vec3::new(f32::from_bits(w.x), f32::from_bits(w.y), f32::from_bits(w.z))
}

impl PackedEntry {
    /// A path that has ended, with what it found.
    #[inline(always)]
    pub(super) fn ended(radiance: Vec3) -> Self {
        Self([pack(radiance, 0), UVec4::ZERO, UVec4::ZERO, UVec4::ZERO])
    }

    /// A path that has entered a body, with what it found so far.
    #[inline(always)]
    pub(super) fn entered(entry: &Entry, radiance: Vec3) -> Self {
        let Entry { hit, throughput, depth, travelled } = *entry;
        let place = UVec4::new(hit.uv.x.to_bits(), hit.uv.y.to_bits(), travelled.to_bits(), 0);
        Self([pack(radiance, depth | ENTERED), pack(throughput, hit.id), place, UVec4::ZERO])
    }

    /// A path that goes on outside, with what it found so far.
    #[inline(always)]
    pub(super) fn going_on(walk: &Walk, radiance: Vec3) -> Self {
        let Walk { ray, throughput, chosen, depth } = *walk;
        Self([
            pack(radiance, depth | GOES_ON),
            pack(throughput, ray.key),
            pack(ray.origin, chosen.pdf.to_bits()),
            pack(ray.direction, 0),
        ])
    }

    #[inline(always)]
    pub(super) fn radiance(&self) -> Vec3 {
        vector(self.0[0])
    }

    /// Whether the path has entered a body.
    #[inline(always)]
    pub fn is_inside(&self) -> bool {
        self.0[0].w & ENTERED != 0
    }

    /// Whether the path goes on outside.
    #[inline(always)]
    pub fn goes_on(&self) -> bool {
        self.0[0].w & GOES_ON != 0
    }

    #[inline(always)]
    pub(super) fn entry(&self) -> Entry {
        let [radiance, throughput, place, _] = self.0;
        let uv = Vec2::new(f32::from_bits(place.x), f32::from_bits(place.y));
        Entry {
            hit: Hit { t: Ray::FAR, id: throughput.w, uv },
            throughput: vector(throughput),
            depth: radiance.w & DEPTH,
            travelled: f32::from_bits(place.z),
        }
    }

    #[inline(always)]
    pub(super) fn resumed(&self) -> Resumed {
        let [radiance, throughput, origin, direction] = self.0;
        let ray = Ray { origin: vector(origin), direction: vector(direction), t_max: Ray::FAR, key: throughput.w };
        let chosen = Chosen { pdf: f32::from_bits(origin.w), alone: false };
        Resumed {
            walk: Walk { ray, throughput: vector(throughput), chosen, depth: radiance.w & DEPTH },
            radiance: vector(radiance),
            alive: self.goes_on(),
        }
    }
}
