//! Rays against triangles: [`TriangleTest`](restir_shared::geometry::TriangleTest), a leaf at a time.

use super::boxes::Boxes;
use super::node::{PARTIAL, Vertices};
use super::simd::{F32x8, splat, take_lowest};
use glam::{Vec2, Vec3};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::num;

/// A ray prepared for them, the same in every lane or another in each.
pub(super) struct Triangles<L> {
    /// The axes in the order of the test's x, y, z.
    axes: [usize; 3],
    /// By the scene's axes.
    origin: [L; 3],
    shear_x: L,
    shear_y: L,
    scale: L,
}

/// The axes in the order of the test's x, y, z, by the one that is last.
pub(super) static ROTATIONS: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

impl<L: F32x8> Triangles<L> {
    /// `TriangleTest::new`.
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let axes = ROTATIONS[largest(ray.direction) as usize];
        let [x, y, z] = axes.map(|axis| ray.direction[axis]);
        let [shear_x, shear_y, scale] = shear(x, y, z);
        Self {
            axes,
            origin: splat(ray.origin),
            shear_x: L::splat(shear_x),
            shear_y: L::splat(shear_y),
            scale: L::splat(scale),
        }
    }

    /// Of another ray in each lane, along all of which `axes` is the order of axes ([`ROTATIONS`]), with what [`shear`] says of each.
    #[inline(always)]
    pub(super) fn of_each(origin: [L; 3], [shear_x, shear_y, scale]: [L; 3], axes: [usize; 3]) -> Self {
        Self { axes, origin, shear_x, shear_y, scale }
    }

    /// A vertex in sheared coordinates, but for the scale of z.
    #[inline(always)]
    fn sheared(&self, triangles: impl Vertices<L>, vertex: usize) -> [L; 3] {
        let [x, y, z] = self.axes;
        let z = self.relative(triangles, vertex, z);
        let (x, y) = (self.relative(triangles, vertex, x), self.relative(triangles, vertex, y));
        [x - self.shear_x * z, y - self.shear_y * z, z]
    }

    #[inline(always)]
    fn relative(&self, triangles: impl Vertices<L>, vertex: usize, axis: usize) -> L {
        triangles.coordinate(vertex, axis) - self.origin[axis]
    }

    /// `TriangleTest::hit` in every lane; `None` if there is a hit in none.
    #[inline(always)]
    pub(super) fn hits(&self, triangles: impl Vertices<L>, boxes: &Boxes<L>) -> Option<Hits<L>> {
        let zero = L::splat(0.0);
        let a = self.sheared(triangles, 0);
        let b = self.sheared(triangles, 1);
        let c = self.sheared(triangles, 2);
        let u = flush(c[0] * b[1] - c[1] * b[0]);
        let v = flush(a[0] * c[1] - a[1] * c[0]);
        let w = flush(b[0] * a[1] - b[1] * a[0]);
        let front = zero.le(u) & zero.le(v) & zero.le(w);
        let back = u.le(zero) & v.le(zero) & w.le(zero);
        let det = u + v + w;
        let inside = (front | back) & (det.lt(zero) | zero.lt(det));
        if inside.bits() == 0 {
            return None;
        }
        let inv = L::splat(1.0) / det;
        let t = (u * (a[2] * self.scale) + v * (b[2] * self.scale) + w * (c[2] * self.scale)) * inv;
        let (t0, t1) = boxes.bounds(triangles);
        let t = t.min(t1).max(t0);
        Some(Hits { lanes: inside & t0.le(t1) & zero.lt(t), t, v: v * inv, w: w * inv })
    }
}

/// The axis along which the direction is largest, without branches: which one it is is hard to predict.
#[inline(always)]
pub(super) fn largest(direction: Vec3) -> u32 {
    let (x, y, z) = (num::abs(direction.x), num::abs(direction.y), num::abs(direction.z));
    let is_x = u32::from((x > y) & (x > z));
    let is_y = u32::from(y > z) & (1 - is_x);
    2 - 2 * is_x - is_y
}

/// By how much of z the test's x and y are sheared, and the scale of z.
#[inline(always)]
pub(super) fn shear(x: f32, y: f32, z: f32) -> [f32; 3] {
    let scale = num::recip(z);
    [x * scale, y * scale, scale]
}

/// Hits in the lanes.
pub(super) struct Hits<L> {
    /// Of which there are any.
    lanes: L,
    t: L,
    v: L,
    w: L,
}

impl<L: F32x8> Hits<L> {
    /// The lanes with a hit at `t <= limit`.
    #[inline(always)]
    pub(super) fn up_to(&self, limit: L) -> u32 {
        (self.lanes & self.t.le(limit)).bits()
    }

    /// The lanes with a hit at `t < limit`.
    #[inline(always)]
    pub(super) fn before(&self, limit: f32) -> u32 {
        (self.lanes & self.t.lt(L::splat(limit))).bits()
    }

    /// Shows the hits in `lanes` one by one, each with its lane and with whether its triangle is marked, until one is `enough`; whether
    /// one was. `id` gives the id of a lane's triangle, with its marks.
    #[inline(always)]
    pub(super) fn visit(
        &self,
        mut lanes: u32,
        id: impl Fn(usize) -> u32,
        mut enough: impl FnMut(usize, &Hit, bool) -> bool,
    ) -> bool {
        if lanes == 0 {
            return false;
        }
        let (t, v, w) = (self.t.store(), self.v.store(), self.w.store());
        while lanes != 0 {
            let lane = take_lowest(&mut lanes);
            let id = id(lane);
            let hit = Hit { t: t.0[lane], id: id & !PARTIAL, uv: Vec2::new(v.0[lane], w.0[lane]) };
            if enough(lane, &hit, id & PARTIAL != 0) {
                return true;
            }
        }
        false
    }
}

/// [`num::flush`].
#[inline(always)]
fn flush<L: F32x8>(x: L) -> L {
    let magnitude = x & L::splat(f32::from_bits(0x7fff_ffff));
    x.unless(magnitude.lt(L::splat(num::FLUSH_BELOW)))
}
