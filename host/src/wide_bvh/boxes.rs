//! Rays against boxes: those of a node, or of the triangles of a pack.

use super::simd::{Lanes, splat};
use super::{Node, Pack};
use restir_shared::geometry::Slab;

/// [`Slab`] in every lane.
pub(super) struct Boxes<L> {
    /// What is subtracted from lower and upper planes, by axis.
    origins: [[L; 2]; 3],
    inverse: [L; 3],
    /// 1 where the direction is negative, so that the upper plane is the nearer one.
    near: [usize; 3],
}

impl<L: Lanes> Boxes<L> {
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
    pub(super) fn bounds(&self, pack: &Pack) -> (L, L) {
        interval([self.bounds_along(pack, 0), self.bounds_along(pack, 1), self.bounds_along(pack, 2)])
    }

    #[inline(always)]
    fn bounds_along(&self, pack: &Pack, axis: usize) -> [L; 2] {
        let a = L::load(&pack.vertices[0][axis]);
        let b = L::load(&pack.vertices[1][axis]);
        let c = L::load(&pack.vertices[2][axis]);
        let lower = self.distance(axis, 0, a.min(b).min(c));
        let upper = self.distance(axis, 1, a.max(b).max(c));
        [lower.min(upper), lower.max(upper)]
    }
}

/// Where a ray is in three slabs.
#[inline(always)]
fn interval<L: Lanes>([x, y, z]: [[L; 2]; 3]) -> (L, L) {
    (x[0].max(y[0]).max(z[0].max(L::splat(0.0))), x[1].min(y[1]).min(z[1]))
}

#[inline(always)]
fn sign(x: f32) -> usize {
    (x.to_bits() >> 31) as usize
}
