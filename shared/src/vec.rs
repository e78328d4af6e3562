//! Vector algebra over [`Vec3`] in a fixed order of evaluation.
//!
//! glam's componentwise `+ - *` are used as they are; whatever sums components is spelled out here, because
//! glam's own order depends on the platform.
//!
//! ```
//! use restir_shared::glam::Vec3;
//! use restir_shared::vec::{Frame, cross, dot, length, normalize};
//!
//! let normal = normalize(Vec3::new(1.0, 2.0, 2.0));
//! assert!((length(normal) - 1.0).abs() < 1e-6);
//!
//! // in the frame around a normal, the normal is +z, and tangents are perpendicular to it
//! let frame = Frame::new(normal);
//! assert!((frame.to_local(normal) - Vec3::Z).length() < 1e-6);
//! assert!((cross(frame.s, frame.t) - normal).length() < 1e-6);
//!
//! // a direction by its cosine to the normal, in the world
//! let world = frame.to_world(Vec3::new(0.6, 0.0, 0.8));
//! assert!((dot(world, normal) - 0.8).abs() < 1e-6);
//! ```

use crate::num;
use glam::Vec3;

/// `a . b`, summed from x to z.
#[inline(always)]
pub fn dot(a: Vec3, b: Vec3) -> f32 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// The cross product `a x b`.
#[inline(always)]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// `|a|`; the square must neither overflow nor vanish: magnitudes in [2^-50, 2^60].
#[inline(always)]
pub fn length(a: Vec3) -> f32 {
    num::sqrt(dot(a, a))
}

/// `a / |a|`, on the domain of [`length`].
#[inline(always)]
pub fn normalize(a: Vec3) -> Vec3 {
    a * num::rsqrt(dot(a, a))
}

/// Named point of flushing: magnitudes below 2^-100 are zero.
#[inline(always)]
pub fn flush(v: Vec3) -> Vec3 {
    Vec3::new(num::flush(v.x), num::flush(v.y), num::flush(v.z))
}

/// The largest magnitude among the components.
#[inline(always)]
pub(crate) fn max_abs(a: Vec3) -> f32 {
    num::max(num::max(num::abs(a.x), num::abs(a.y)), num::abs(a.z))
}

/// The largest component.
#[inline(always)]
pub fn max_component(a: Vec3) -> f32 {
    num::max(num::max(a.x, a.y), a.z)
}

/// Componentwise minimum.
#[inline(always)]
pub fn min(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(num::min(a.x, b.x), num::min(a.y, b.y), num::min(a.z, b.z))
}

/// Componentwise maximum.
#[inline(always)]
pub fn max(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(num::max(a.x, b.x), num::max(a.y, b.y), num::max(a.z, b.z))
}

/// Relative luminance of linear RGB (Rec. 709).
#[inline(always)]
pub fn luminance(rgb: Vec3) -> f32 {
    dot(rgb, Vec3::new(0.212_6, 0.715_2, 0.072_2))
}

/// An orthonormal frame around a unit vector (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First tangent.
    pub s: Vec3,
    /// Second tangent.
    pub t: Vec3,
    /// The given vector.
    pub n: Vec3,
}

impl Frame {
    /// The frame around the unit vector `n`.
    #[inline(always)]
    pub fn new(n: Vec3) -> Self {
        let sign = if n.z < 0.0 { -1.0 } else { 1.0 };
        let a = -num::recip(sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * (n.x * n.x * a), sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// From coordinates in the frame to the world.
    #[inline(always)]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }

    /// From the world to coordinates in the frame.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(dot(self.s, v), dot(self.t, v), dot(self.n, v))
    }
}
