//! Directions around +z.

use super::{azimuth, to_unit};
use crate::num;
use glam::{Vec2, Vec3};

/// A unit vector with density [`cosine_hemisphere_pdf`]; `u` in [0, 1)^2.
///
/// Malley's method: a point uniform on the disk, projected up; z from `1 - u.x` itself, so that it does not cancel.
#[inline(always)]
pub fn sample_cosine_hemisphere(u: Vec2) -> Vec3 {
    let r = num::sqrt(u.x);
    let (sin, cos) = num::sin_cos(u.y);
    Vec3::new(r * cos, r * sin, num::sqrt(1.0 - u.x))
}

/// cos / pi per steradian, where `cos` is the z of the direction; zero below the horizon.
#[inline(always)]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    num::max(cos, 0.0) * num::INV_PI
}

/// The `u` of which [`sample_cosine_hemisphere`] makes the unit vector `w`.
#[inline(always)]
pub fn invert_cosine_hemisphere(w: Vec3) -> Vec2 {
    Vec2::new(to_unit(w.x * w.x + w.y * w.y), azimuth(w.y, w.x))
}
