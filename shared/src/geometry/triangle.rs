//! Slabs and triangles.

use super::{Hit, Ray};
#[cfg(not(target_arch = "spirv"))]
use crate::lanes::soa;
use crate::num;
use crate::vec::{max, max_abs, min};
use glam::{Vec2, Vec3};

/// Bounds are padded by this fraction of the largest distance between the ray's origin and the scene's bounds, which is
/// three times the error of the triangle test, and of the origin's own coordinates, lest the padding be rounded away: 2^-19.
const PADDING: f32 = 1.0 / 524_288.0;
/// Components of a direction below 2^-80 count as 2^-80 in the slab test, so that no product is NaN.
const MIN_DIRECTION: f32 = 8.271_806e-25;

/// A ray prepared for the slab test. The fields are there for traversals that do the same arithmetic in vectors.
#[derive(Clone, Copy, Debug)]
pub struct Slab {
    /// What is subtracted from lower planes: the origin, moved up by the padding.
    pub lo_origin: Vec3,
    /// What is subtracted from upper planes: the origin, moved down by the padding.
    pub hi_origin: Vec3,
    /// The reciprocal of the direction, finite.
    pub inverse: Vec3,
}

#[cfg(not(target_arch = "spirv"))]
soa! {
    Slabs = Slab { lo_origin: Vec3, hi_origin: Vec3, inverse: Vec3 }
    TriangleTests = TriangleTest { origin: Vec3, shear_x: f32, shear_y: f32, scale: f32, axis: u32 }
}

#[inline(always)]
fn inverse(x: f32) -> f32 {
    let floor = if x < 0.0 { -MIN_DIRECTION } else { MIN_DIRECTION };
    num::recip(if num::abs(x) < MIN_DIRECTION { floor } else { x })
}

impl Slab {
    /// Prepares `ray` for a scene with the given bounds.
    #[inline(always)]
    pub fn new(ray: &Ray, bounds_lo: Vec3, bounds_hi: Vec3) -> Self {
        let reach = num::max(max_abs(bounds_lo - ray.origin), max_abs(bounds_hi - ray.origin));
        let padding = Vec3::splat((reach + max_abs(ray.origin)) * PADDING);
        let d = ray.direction;
        Self {
            lo_origin: ray.origin + padding,
            hi_origin: ray.origin - padding,
            inverse: Vec3::new(inverse(d.x), inverse(d.y), inverse(d.z)),
        }
    }

    /// The interval `[t0, t1]`, t0 >= 0, in which the ray is inside the padded box; empty if t0 > t1.
    ///
    /// Monotone: a box that contains another has an interval that contains the other's, bit for bit.
    #[inline(always)]
    pub fn interval(&self, lo: Vec3, hi: Vec3) -> (f32, f32) {
        let a = (lo - self.lo_origin) * self.inverse;
        let b = (hi - self.hi_origin) * self.inverse;
        let near = min(a, b);
        let far = max(a, b);
        (num::max(num::max(near.x, near.y), num::max(near.z, 0.0)), num::min(num::min(far.x, far.y), far.z))
    }
}

/// A ray prepared for the watertight test of Woop, Benthin and Wald 2013 (JCGT 2(1)).
///
/// Edges are tested on the vertices sheared along the ray, by products that only change sign when the edge is
/// traversed the other way: of two triangles at an edge at least one is hit. Where the original repeats a zero in
/// double precision, zero here counts as inside on both sides.
#[derive(Clone, Copy, Debug)]
pub struct TriangleTest {
    origin: Vec3,
    shear_x: f32,
    shear_y: f32,
    scale: f32,
    /// The axis along which the direction is largest: 0, 1, 2.
    axis: u32,
}

/// The components of `v` with `axis` last, in cyclic order.
#[inline(always)]
fn rotate(v: Vec3, axis: u32) -> Vec3 {
    if axis == 0 {
        Vec3::new(v.y, v.z, v.x)
    } else if axis == 1 {
        Vec3::new(v.z, v.x, v.y)
    } else {
        v
    }
}

impl TriangleTest {
    /// Prepares `ray`.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let (x, y, z) = (num::abs(d.x), num::abs(d.y), num::abs(d.z));
        let axis = if (x > y) & (x > z) {
            0
        } else if y > z {
            1
        } else {
            2
        };
        let d = rotate(d, axis);
        let scale = num::recip(d.z);
        Self { origin: ray.origin, shear_x: d.x * scale, shear_y: d.y * scale, scale, axis }
    }

    /// A vertex in sheared coordinates: x and y across the ray, z along it in units of t.
    #[inline(always)]
    fn shear(&self, vertex: Vec3) -> Vec3 {
        let v = rotate(vertex - self.origin, self.axis);
        Vec3::new(v.x - self.shear_x * v.z, v.y - self.shear_y * v.z, v.z * self.scale)
    }

    /// The hit of triangle `id` for t > 0, or [`Hit::MISS`]. `slab` is the same ray.
    ///
    /// A triangle seen edge-on, with less than 2^-100 of sheared area, is never hit.
    #[inline(always)]
    pub fn hit(&self, slab: &Slab, id: u32, v0: Vec3, v1: Vec3, v2: Vec3) -> Hit {
        let crossing = self.crossing(v0, v1, v2);
        if crossing.misses() {
            return Hit::MISS;
        }
        crossing.hit(slab, id, min(min(v0, v1), v2), max(max(v0, v1), v2))
    }

    /// Where the ray's line crosses the plane of a triangle.
    #[inline(always)]
    pub fn crossing(&self, v0: Vec3, v1: Vec3, v2: Vec3) -> Crossing {
        let a = self.shear(v0);
        let b = self.shear(v1);
        let c = self.shear(v2);
        let u = num::flush(c.x * b.y - c.y * b.x);
        let v = num::flush(a.x * c.y - a.y * c.x);
        let w = num::flush(b.x * a.y - b.y * a.x);
        // written so that a NaN is no hit
        let inside = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0));
        let det = u + v + w;
        Crossing { areas: Vec3::new(u, v, w), t: Vec3::new(a.z, b.z, c.z), inside, det }
    }
}

/// Where a ray's line crosses the plane of a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Twice the sheared areas opposite to the vertices.
    areas: Vec3,
    /// Of each vertex.
    t: Vec3,
    inside: bool,
    /// The sum of the areas.
    det: f32,
}

impl Crossing {
    /// Whether that is outside of the triangle, or it is seen edge-on.
    #[inline(always)]
    pub fn misses(&self) -> bool {
        !self.inside | (self.det == 0.0)
    }

    /// The hit of triangle `id`, whose bounds are `lo` and `hi`, for t > 0, or [`Hit::MISS`], unless it [`Self::misses`].
    #[inline(always)]
    pub fn hit(&self, slab: &Slab, id: u32, lo: Vec3, hi: Vec3) -> Hit {
        let Self { areas, t, .. } = self;
        let inv = num::recip(self.det);
        let t = (areas.x * t.x + areas.y * t.y + areas.z * t.z) * inv;
        let (t0, t1) = slab.interval(lo, hi);
        let t = num::max(num::min(t, t1), t0);
        if !((t0 <= t1) & (t > 0.0)) {
            return Hit::MISS;
        }
        Hit { t, id, uv: Vec2::new(areas.y * inv, areas.z * inv) }
    }
}
