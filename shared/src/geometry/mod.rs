//! Rays, the watertight triangle test, BVH traversal.
//!
//! **The closest hit is defined** as the smallest (t, id) over all hits by [`TriangleTest`] that count, and any traversal
//! finds it exactly. Whether a hit counts is a function of ray and hit alone ([`Coverage`]): a mask leaves triangles out where
//! it is zero, so what is behind is hit. This does not rest on an error analysis: a hit's t is limited to the interval in which the ray
//! passes the triangle's own padded bounds, computed by the same arithmetic as for the boxes of the BVH. That
//! arithmetic is monotone, so every box around the triangle has an interval at least as wide, and none that holds
//! the hit can be culled. For the same reason any traversal finds **all** hits on a segment ([`Crossings`]).
//!
//! ```
//! use restir_shared::geometry::{Ray, Slab, TriangleTest};
//! use restir_shared::glam::Vec3;
//!
//! let ray = Ray { origin: Vec3::new(0.5, 0.5, 3.0), direction: Vec3::NEG_Z, t_max: Ray::FAR, key: 0 };
//! let (slab, test) = (Slab::new(&ray, Vec3::ZERO, Vec3::ONE), TriangleTest::new(&ray));
//!
//! // the box of the scene is entered and left again, padded by less than 2^-16 of the distances
//! let (near, far) = slab.interval(Vec3::ZERO, Vec3::ONE);
//! assert!((near - 2.0).abs() < 1e-4 && (far - 3.0).abs() < 1e-4);
//!
//! // two triangles of a square share the edge through the middle of the ray: it does not slip between them
//! let corners = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
//! let hits = [[0, 1, 2], [0, 2, 3]].map(|[a, b, c]| test.hit(&slab, 0, corners[a], corners[b], corners[c]));
//! assert!(hits.iter().any(|hit| hit.is_hit() && hit.t == 3.0));
//! ```

mod coverage;
mod crossings;
mod packed_hit;
mod pending;
mod ring;
mod traverse;
mod triangle;
#[cfg(target_arch = "spirv")]
pub(crate) mod workgroup;

pub use coverage::{Coverage, Solid};
pub use crossings::Crossings;
pub use packed_hit::PackedHit;
#[doc(hidden)]
pub use ring::Scratch;
// for hierarchies other than that of the arenas, which have to find the same hits
#[doc(hidden)]
pub use traverse::{traverse, traverse_all};
#[doc(hidden)]
pub use triangle::{Crossing, Slab, TriangleTest};

use crate::layout::{FEATURE_BLEND, NONE};
use crate::rng::{pcg4d, unit};
use crate::vec::flush;
use glam::{UVec4, Vec2, Vec3};

/// A ray, or a segment if `t_max` is finite; `direction` need not have unit length.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ray {
    /// Where it begins; |components| at most 2^32, where those of the scene are at most 2^30.
    pub origin: Vec3,
    /// Not zero: its largest component is no smaller than 2^-60 times the largest distance to a vertex, and at most 2^40.
    pub direction: Vec3,
    /// Hits lie at `0 < t < t_max`.
    pub t_max: f32,
    /// What decides, with the bits of origin and direction, whether the ray meets a blended surface ([`Self::chance`]). Rays that
    /// are the same but for their keys decide independently of each other.
    pub key: u32,
}

impl Ray {
    /// A `t_max` beyond every hit.
    pub const FAR: f32 = 1.0e30;
    /// A ray that meets nothing.
    pub const NONE: Self = Self { origin: Vec3::ZERO, direction: Vec3::Z, t_max: 0.0, key: 0 };
    /// The key of a ray that meets no blended surface at all.
    #[doc(hidden)]
    pub const THROUGH: u32 = u32::MAX;

    /// A key, which is not [`Self::THROUGH`], of a random word: in a scene of these features, without blending always 0.
    #[doc(hidden)]
    #[inline(always)]
    pub fn random_key(features: u32, word: u32) -> u32 {
        if features & FEATURE_BLEND != 0 { word >> 1 } else { 0 }
    }

    /// A number, uniform in [0, 1) over rays and triangles: the ray meets the blended triangle where this is below the surface's
    /// alpha. 1 for [`Self::THROUGH`]. To ask twice gives the same answer.
    #[doc(hidden)]
    #[inline(always)]
    pub fn chance(&self, triangle: u32) -> f32 {
        let (origin, direction) = (flush(self.origin), flush(self.direction));
        let from = pcg4d(UVec4::new(origin.x.to_bits(), origin.y.to_bits(), origin.z.to_bits(), self.key));
        let to = UVec4::new(direction.x.to_bits(), direction.y.to_bits(), direction.z.to_bits(), triangle);
        let word = pcg4d(UVec4::new(from.x ^ to.x, from.y ^ to.y, from.z ^ to.z, from.w ^ to.w)).x;
        if self.key == Self::THROUGH { 1.0 } else { unit(word) }
    }
}

/// The result of a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Primitive, or [`NONE`].
    pub id: u32,
    /// Of a triangle the barycentric coordinates of its second and third vertex; of anything else what its scene finds the point by.
    pub uv: Vec2,
}

#[cfg(not(target_arch = "spirv"))]
crate::lanes::soa! {
    Rays = Ray { origin: Vec3, direction: Vec3, t_max: f32, key: u32 }
    Hits = Hit { t: f32, id: u32, uv: Vec2 }
}

impl Hit {
    /// Nothing was hit.
    pub const MISS: Self = Self { t: Ray::FAR, id: NONE, uv: Vec2::ZERO };

    /// The device ended the search before its time. Some limit the rounds of an invocation's loops: lavapipe to 65 535.
    /// A sample in which this happens has to be dropped.
    #[doc(hidden)]
    pub const CUT: Self = Self { t: f32::MAX, id: NONE, uv: Vec2::ZERO };

    /// Whether this is [`Self::CUT`].
    #[doc(hidden)]
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
