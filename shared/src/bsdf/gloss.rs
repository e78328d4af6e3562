//! How glossy a surface is: what of it turns with the direction that it is seen from.
//!
//! ```
//! use restir_shared::bsdf::Gloss;
//! use restir_shared::glam::Vec3;
//!
//! // a mirror of alpha 0.1, seen from above and half a degree beside, then ten degrees
//! let (mirror, above) = (Gloss { share: 1.0, alpha: 0.1 }, Vec3::Z);
//! let beside = |degrees: f32| Vec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos());
//! assert!(mirror.kept(30.0, above, beside(0.5)) > 0.8);
//! assert!(mirror.kept(30.0, above, beside(10.0)) < 0.02);
//! // what does not shine is the same from everywhere
//! assert_eq!(Gloss::NONE.kept(30.0, above, beside(10.0)), 1.0);
//! ```

use crate::num;
use glam::Vec3;

/// Added to the square of alpha: the pixels that see the same surface in two frames do not see the same point of it, and lobes that are
/// narrower than the turn of the normal from pixel to pixel are lost already.
const LEAST_SQUARED_WIDTH: f32 = 1.0e-3;

/// The strength and the width of specular lobes, seen from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// Roughly their part in what is scattered, in [0, 1].
    pub share: f32,
    /// GGX's alpha, in [0, 1].
    pub alpha: f32,
}

impl Gloss {
    /// Of a surface that is the same from all directions.
    pub const NONE: Self = Self { share: 0.0, alpha: 1.0 };

    /// What is left of the worth of samples that were chosen for the direction `then` to the viewer where it is `now`, both unit vectors:
    /// `1 / (1 + rate (s d)^2 / (alpha^2 + 0.001))`, s being the share and d the distance of the directions, for angles that are not large the
    /// angle in radians. In (0, 1] for rates >= 0. It is ours, found by trial, and depends on surfaces alone, so that reuse stays unbiased whatever it is.
    #[inline(always)]
    pub fn kept(&self, rate: f32, now: Vec3, then: Vec3) -> f32 {
        let turned = (now - then) * self.share;
        let width = self.alpha * self.alpha + LEAST_SQUARED_WIDTH;
        num::div(width, width + rate * crate::vec::dot(turned, turned))
    }
}
