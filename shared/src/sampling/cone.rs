//! Directions in a cone around +z, uniform over solid angle.
//!
//! A cone is given by the versine of its half angle, `1 - cos`: narrow cones have a cosine of 1, but not a versine
//! of 0. Heights are measured from the pole for the same reason.

use super::{azimuth, to_unit};
use crate::num;
use glam::{Vec2, Vec3};

const INV_2_PI: f32 = 0.5 * num::INV_PI;

/// A unit vector, uniform over the solid angle of the cone; `u` in [0, 1)^2, `versine` in (0, 2].
#[inline(always)]
pub fn sample_cone(u: Vec2, versine: f32) -> Vec3 {
    below_pole(u.x * versine, u.y)
}

/// 1 / (2 pi versine) per steradian, for directions in the cone.
#[inline(always)]
pub fn cone_pdf(versine: f32) -> f32 {
    num::div(INV_2_PI, versine)
}

/// The `u` of which [`sample_cone`] makes the unit vector `w`.
#[inline(always)]
pub fn invert_cone(w: Vec3, versine: f32) -> Vec2 {
    Vec2::new(to_unit(num::div(depth_below_pole(w), versine)), azimuth(w.y, w.x))
}

/// The versine of an acute angle of which the squared sine is given, in [0, 1]: of the cone of directions to a sphere
/// from outside, with `sin2 = radius^2 / distance^2`.
#[inline(always)]
pub fn versine_of_sin2(sin2: f32) -> f32 {
    num::div(sin2, 1.0 + num::sqrt(1.0 - sin2))
}

/// The unit vector with `z = 1 - depth` at the given turn around the axis.
#[inline(always)]
pub(super) fn below_pole(depth: f32, turn: f32) -> Vec3 {
    let r = num::sqrt(depth * (2.0 - depth));
    let (sin, cos) = num::sin_cos(turn);
    Vec3::new(r * cos, r * sin, 1.0 - depth)
}

/// `1 - z` of a unit vector, by `(x^2 + y^2) / (1 + z)` in the upper half, where the difference would cancel.
#[inline(always)]
pub(super) fn depth_below_pole(w: Vec3) -> f32 {
    if w.z > 0.0 { num::div(w.x * w.x + w.y * w.y, 1.0 + w.z) } else { 1.0 - w.z }
}
