//! Directions, uniform over the sphere or the upper hemisphere: the cap of a sphere has an area linear in its height
//! (Archimedes).

use super::cone::{below_pole, depth_below_pole};
use super::{azimuth, to_unit};
use crate::num;
use glam::{Vec2, Vec3};

const INV_2_PI: f32 = 0.5 * num::INV_PI;
const INV_4_PI: f32 = 0.25 * num::INV_PI;

/// A unit vector, uniform over the sphere; `u` in [0, 1)^2.
#[inline(always)]
pub fn sample_uniform_sphere(u: Vec2) -> Vec3 {
    below_pole(u.x * 2.0, u.y)
}

/// 1 / 4 pi per steradian.
#[inline(always)]
pub fn uniform_sphere_pdf() -> f32 {
    INV_4_PI
}

/// The `u` of which [`sample_uniform_sphere`] makes the unit vector `w`.
#[inline(always)]
pub fn invert_uniform_sphere(w: Vec3) -> Vec2 {
    Vec2::new(to_unit(depth_below_pole(w) * 0.5), azimuth(w.y, w.x))
}

/// A unit vector, uniform over the hemisphere around +z; `u` in [0, 1)^2. Its z is above zero.
#[inline(always)]
pub fn sample_uniform_hemisphere(u: Vec2) -> Vec3 {
    below_pole(u.x, u.y)
}

/// 1 / 2 pi per steradian, where `cos` is the z of the direction; zero below the horizon.
#[inline(always)]
pub fn uniform_hemisphere_pdf(cos: f32) -> f32 {
    if cos > 0.0 { INV_2_PI } else { 0.0 }
}

/// The `u` of which [`sample_uniform_hemisphere`] makes the unit vector `w`.
#[inline(always)]
pub fn invert_uniform_hemisphere(w: Vec3) -> Vec2 {
    Vec2::new(to_unit(depth_below_pole(w)), azimuth(w.y, w.x))
}
