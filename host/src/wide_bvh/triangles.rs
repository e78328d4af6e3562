//! Rays against triangles: [`TriangleTest`](restir_shared::geometry::TriangleTest), a pack at a time.

use super::boxes::Boxes;
use super::simd::{Lanes, Row, splat, take_lowest};
use super::{PARTIAL, Pack};
use glam::Vec2;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::num;

/// A ray prepared for them.
pub(super) struct Triangles<L> {
    /// The axes in the order of the test's x, y, z.
    axes: [usize; 3],
    /// By the scene's axes.
    origin: [L; 3],
    shear_x: L,
    shear_y: L,
    scale: L,
}

/// Cyclic orders of the axes, by the one that is last.
static ROTATIONS: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

impl<L: Lanes> Triangles<L> {
    /// `TriangleTest::new` without branches: which axis is the largest is hard to predict.
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let d = ray.direction.to_array();
        let [x, y, z] = [num::abs(d[0]), num::abs(d[1]), num::abs(d[2])];
        let is_x = usize::from((x > y) & (x > z));
        let is_y = usize::from(y > z) & (1 - is_x);
        let axes = ROTATIONS[2 - 2 * is_x - is_y];
        let scale = num::recip(d[axes[2]]);
        Self {
            axes,
            origin: splat(ray.origin),
            shear_x: L::splat(d[axes[0]] * scale),
            shear_y: L::splat(d[axes[1]] * scale),
            scale: L::splat(scale),
        }
    }

    /// Vertices in sheared coordinates, but for the scale of z.
    #[inline(always)]
    fn shear(&self, vertices: &[Row; 3]) -> [L; 3] {
        let [x, y, z] = self.axes;
        let (x, y, z) = (self.relative(vertices, x), self.relative(vertices, y), self.relative(vertices, z));
        [x - self.shear_x * z, y - self.shear_y * z, z]
    }

    #[inline(always)]
    fn relative(&self, vertices: &[Row; 3], axis: usize) -> L {
        L::load(&vertices[axis]) - self.origin[axis]
    }

    /// `TriangleTest::hit` of all triangles of the pack; `None` if the ray passes beside each.
    #[inline(always)]
    pub(super) fn hits<'a>(&self, pack: &'a Pack, boxes: &Boxes<L>) -> Option<Hits<'a, L>> {
        let zero = L::splat(0.0);
        let a = self.shear(&pack.vertices[0]);
        let b = self.shear(&pack.vertices[1]);
        let c = self.shear(&pack.vertices[2]);
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
        let (t0, t1) = boxes.bounds(pack);
        let t = t.min(t1).max(t0);
        Some(Hits { pack, lanes: inside & t0.le(t1) & zero.lt(t), t, v: v * inv, w: w * inv })
    }
}

/// Hits of the triangles of a pack.
pub(super) struct Hits<'a, L> {
    pack: &'a Pack,
    /// Of which there are any.
    lanes: L,
    t: L,
    v: L,
    w: L,
}

impl<L: Lanes> Hits<'_, L> {
    /// The lanes with a hit at `t <= limit`.
    #[inline(always)]
    pub(super) fn up_to(&self, limit: f32) -> u32 {
        (self.lanes & self.t.le(L::splat(limit))).bits()
    }

    /// The lanes with a hit at `t < limit`.
    #[inline(always)]
    pub(super) fn before(&self, limit: f32) -> u32 {
        (self.lanes & self.t.lt(L::splat(limit))).bits()
    }

    /// Shows the hits in `lanes` one by one, each with whether its triangle is marked, until one is `enough`; whether one was.
    #[inline(always)]
    pub(super) fn visit(&self, mut lanes: u32, mut enough: impl FnMut(&Hit, bool) -> bool) -> bool {
        if lanes == 0 {
            return false;
        }
        let (t, v, w) = (self.t.store(), self.v.store(), self.w.store());
        while lanes != 0 {
            let lane = take_lowest(&mut lanes);
            let id = self.pack.ids[lane];
            let hit = Hit { t: t.0[lane], id: id & !PARTIAL, uv: Vec2::new(v.0[lane], w.0[lane]) };
            if enough(&hit, id & PARTIAL != 0) {
                return true;
            }
        }
        false
    }
}

/// [`num::flush`].
#[inline(always)]
fn flush<L: Lanes>(x: L) -> L {
    let magnitude = x & L::splat(f32::from_bits(0x7fff_ffff));
    x.unless(magnitude.lt(L::splat(num::FLUSH_BELOW)))
}
