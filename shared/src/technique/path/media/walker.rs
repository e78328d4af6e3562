//! The path of a pixel, and how it waits in a plane.

use super::MediaParams;
use crate::geometry::{Hit, Ray};
use crate::rng::Rng;
use crate::technique::path::{Chosen, MAX_DEPTH, Walk, camera_segment};
use bytemuck::{Pod, Zeroable};
use glam::{UVec4, Vec2, Vec3};

/// Counts of a pixel: sums over its samples, which wrap at 2^32.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Tally {
    /// How often paths have entered an interior that scatters.
    pub walks: u32,
    /// Collisions in all of these walks.
    pub scatterings: u32,
    /// Paths that ended because they had too many segments inside of media: their light is lost.
    pub cut: u32,
    /// How often a path met the front of the body that it was inside of. It had left without crossing the surface, by rounding, and has
    /// come back.
    pub leaks: u32,
}

/// A path on its way.
pub(super) struct Walker {
    pub(super) walk: Walk,
    /// What it has found so far.
    pub(super) radiance: Vec3,
    /// Where it has entered what is around it; a miss outside of everything.
    pub(super) entry: Hit,
    /// Segments inside of media so far.
    pub(super) steps: u32,
    /// Collisions so far.
    pub(super) order: u32,
    pub(super) alive: bool,
    /// What was counted of the pixel.
    pub(super) tally: Tally,
}

/// A path that waits after a collision: 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct PackedWalker(pub [UVec4; 4]);

/// Bit of the last word that is set while the path goes on; below it lie its depth, and the density with which the last collision has chosen the
/// direction, without the sign and the last bits.
const ALIVE: u32 = 1 << 31;
const DEPTH: u32 = 20;
const LOST_BITS: u32 = 11;
const _: () = assert!(MAX_DEPTH << DEPTH < ALIVE && DEPTH + LOST_BITS == 31);
/// Steps between two barycentric coordinates of an entry.
const COORDINATES: f32 = 65_536.0;
const STEP: f32 = 1.0 / COORDINATES;

/// A hit without its distance, whose coordinates are rounded to 16 bits: where a path enters, so that it can wait in less.
#[inline(always)]
pub(super) fn entry(hit: &Hit) -> Hit {
    unpack_entry(hit.id, pack_coordinates(hit.uv))
}

/// Where light would have entered what lies around a body ([`crate::medium::Interior::around`]).
#[inline(always)]
pub(super) fn enclosing(around: u32) -> Hit {
    unpack_entry(around.wrapping_sub(1), 0)
}

/// A density in as many bits as a path that waits has for it. Which one counts in the balance heuristic is arbitrary, as long as it is the same
/// for both ways to find a light.
#[inline(always)]
pub(super) fn storable(pdf: f32) -> f32 {
    f32::from_bits(pdf.to_bits() >> LOST_BITS << LOST_BITS)
}

#[inline(always)]
fn pack_coordinates(uv: Vec2) -> u32 {
    let cell = |x: f32| crate::num::clamp(x * COORDINATES, 0.0, COORDINATES - 1.0) as u32;
    cell(uv.x) | (cell(uv.y) << 16)
}

#[inline(always)]
fn unpack_entry(id: u32, coordinates: u32) -> Hit {
    let coordinate = |cell: u32| (cell as f32) * STEP;
    Hit { t: Ray::FAR, id, uv: Vec2::new(coordinate(coordinates & 0xffff), coordinate(coordinates >> 16)) }
}

impl Walker {
    /// The path of a sample from the camera on.
    #[inline(always)]
    pub(super) fn new(params: &MediaParams, rng: &Rng, features: u32, pixel: [u32; 2], tally: Tally) -> Self {
        let ray = camera_segment(&params.path, rng, features, pixel);
        Self {
            walk: Walk::new(ray),
            radiance: Vec3::ZERO,
            entry: Hit::MISS,
            steps: 0,
            order: 0,
            alive: params.path.max_depth > 0,
            tally,
        }
    }
}

impl PackedWalker {
    /// The word of a path that says whether it goes on, and the bit of it.
    pub const GOES_ON: (usize, u32) = (15, ALIVE);

    #[inline(always)]
    pub(super) fn pack(walker: &Walker) -> Self {
        let Walker { walk, radiance, entry, .. } = walker;
        let word = |v: Vec3, w: u32| UVec4::new(v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), w);
        let alive = if walker.alive { ALIVE } else { 0 };
        Self([
            word(walk.ray.origin, walker.steps | (walker.order << 16)),
            word(walk.ray.direction, entry.id),
            word(walk.throughput, pack_coordinates(entry.uv)),
            word(*radiance, alive | (walk.depth << DEPTH) | (walk.chosen.pdf.to_bits() >> LOST_BITS)),
        ])
    }

    #[inline(always)]
    pub(super) fn unpack(self, tally: Tally) -> Walker {
        let [origin, direction, throughput, radiance] = self.0;
        let vector = |w: UVec4| Vec3::new(f32::from_bits(w.x), f32::from_bits(w.y), f32::from_bits(w.z));
        let ray = Ray { origin: vector(origin), direction: vector(direction), t_max: Ray::FAR, key: 0 };
        let pdf = f32::from_bits(radiance.w << LOST_BITS & (ALIVE - 1));
        let depth = (radiance.w & !ALIVE) >> DEPTH;
        Walker {
            walk: Walk { ray, throughput: vector(throughput), chosen: Chosen { pdf, alone: true }, depth },
            radiance: vector(radiance),
            entry: unpack_entry(direction.w, throughput.w),
            steps: origin.w & 0xffff,
            order: origin.w >> 16,
            alive: self.goes_on(),
            tally,
        }
    }

    /// Whether the path goes on.
    #[inline(always)]
    pub fn goes_on(&self) -> bool {
        self.0[3].w & ALIVE != 0
    }
}
