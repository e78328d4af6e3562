//! Rays against boxes: those of a node, or of the triangles of a leaf.

use super::node::{Node, Vertices};
use super::simd::{F32x8, splat};
use restir_shared::geometry::Slab;

/// A [`Slab`], the same in every lane or another in each.
pub(super) struct Boxes<L> {
    /// What is subtracted from lower and upper planes, by axis.
    origins: [[L; 2]; 3],
    inverse: [L; 3],
    /// 1 where the direction is negative, so that the upper plane is the nearer one.
    near: [usize; 3],
}

impl<L: F32x8> Boxes<L> {
    #[inline(always)]
    pub(super) fn new(slab: &Slab) -> Self {
        let (lo, hi, inverse) = (slab.lo_origin, slab.hi_origin, slab.inverse);
        let pair = |lo, hi| [L::splat(lo), L::splat(hi)];
        Self {
            origins: [pair(lo.x, hi.x), pair(lo.y, hi.y), pair(lo.z, hi.z)],
            inverse: splat(inverse),
            near: [sign(inverse.x), sign(inverse.y), sign(inverse.z)],
        }
    }

    /// By axis what the slabs have in each lane, and which plane is the nearer one of children: that of one ray, or nobody asks for children.
    #[inline(always)]
    pub(super) fn of_each(lo_origin: [L; 3], hi_origin: [L; 3], inverse: [L; 3], near: [usize; 3]) -> Self {
        let origins = [[lo_origin[0], hi_origin[0]], [lo_origin[1], hi_origin[1]], [lo_origin[2], hi_origin[2]]];
        Self { origins, inverse, near }
    }

    /// Distances to lower (0) or upper (1) planes.
    #[inline(always)]
    fn distance(&self, axis: usize, side: usize, planes: L) -> L {
        (planes - self.origins[axis][side]) * self.inverse[axis]
    }

    /// The distances at which the ray enters and leaves the children.
    ///
    /// It is [`Slab::interval`]: which of a slab's two distances is the smaller is known beforehand, because the
    /// rounded difference and product are monotone.
    #[inline(always)]
    pub(super) fn children(&self, node: &Node) -> (L, L) {
        interval([self.slab(node, 0), self.slab(node, 1), self.slab(node, 2)])
    }

    #[inline(always)]
    fn slab(&self, node: &Node, axis: usize) -> [L; 2] {
        // `& 1` shows the compiler that it is an index
        let near = self.near[axis] & 1;
        let far = near ^ 1;
        let planes = &node.planes[axis];
        [self.distance(axis, near, L::load(&planes[near])), self.distance(axis, far, L::load(&planes[far]))]
    }

    /// [`Slab::interval`] of the triangles' bounds.
    #[inline(always)]
    pub(super) fn bounds(&self, triangles: impl Vertices<L>) -> (L, L) {
        interval([self.along(0, triangles), self.along(1, triangles), self.along(2, triangles)])
    }

    #[inline(always)]
    fn along(&self, axis: usize, triangles: impl Vertices<L>) -> [L; 2] {
        let [lower, upper] = triangles.bounds(axis);
        let (lower, upper) = (self.distance(axis, 0, lower), self.distance(axis, 1, upper));
        [lower.min(upper), lower.max(upper)]
    }
}

/// Where a ray is in three slabs.
#[inline(always)]
pub(super) fn interval<L: F32x8>([x, y, z]: [[L; 2]; 3]) -> (L, L) {
    (x[0].max(y[0]).max(z[0].max(L::splat(0.0))), x[1].min(y[1]).min(z[1]))
}

/// 1 of a negative number.
#[inline(always)]
pub(super) fn sign(x: f32) -> usize {
    (x.to_bits() >> 31) as usize
}
