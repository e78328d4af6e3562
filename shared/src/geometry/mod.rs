//! Rays, the watertight triangle test, BVH traversal.
//!
//! **The closest hit is defined** as the smallest (t, id) over all triangles by [`TriangleTest`], and any traversal
//! finds it exactly. This does not rest on an error analysis: a hit's t is limited to the interval in which the ray
//! passes the triangle's own padded bounds, computed by the same arithmetic as for the boxes of the BVH. That
//! arithmetic is monotone, so every box around the triangle has an interval at least as wide, and none that holds
//! the hit can be culled.

mod traverse;
mod triangle;

pub use traverse::traverse;
pub use triangle::{Slab, TriangleTest};

use crate::layout::NONE;
use glam::{Vec2, Vec3};

/// A ray, or a segment if `t_max` is finite; `direction` need not have unit length.
#[derive(Clone, Copy)]
pub struct Ray {
    /// Where it begins; |components| at most 2^32, where those of the scene are at most 2^30.
    pub origin: Vec3,
    /// Not zero: its largest component is no smaller than 2^-60 times the largest distance to a vertex, and at most 2^40.
    pub direction: Vec3,
    /// Hits lie at `0 < t < t_max`.
    pub t_max: f32,
}

impl Ray {
    /// A `t_max` beyond every hit.
    pub const FAR: f32 = 1.0e30;
}

/// The result of a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Primitive, or [`NONE`].
    pub id: u32,
    /// Barycentric coordinates of the second and third vertex.
    pub uv: Vec2,
}

impl Hit {
    /// Nothing was hit.
    pub const MISS: Self = Self { t: Ray::FAR, id: NONE, uv: Vec2::ZERO };

    /// The device ended the search before its time. Some limit the rounds of an invocation's loops: lavapipe to 65 535.
    /// A sample in which this happens has to be dropped.
    pub const CUT: Self = Self { t: f32::MAX, id: NONE, uv: Vec2::ZERO };

    /// Whether this is [`Self::CUT`].
    #[inline(always)]
    pub fn is_cut(&self) -> bool {
        self.t == f32::MAX
    }

    /// Whether something was hit.
    #[inline(always)]
    pub fn is_hit(&self) -> bool {
        self.id != NONE
    }
}
