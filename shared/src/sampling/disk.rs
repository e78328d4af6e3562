//! Points of the unit disk.

use super::to_unit;
use crate::num;
use glam::Vec2;

/// A point, uniform over the unit disk; `u` in [0, 1)^2.
///
/// Shirley and Chiu 1997, "A Low Distortion Map Between Disk and Square": squares around the centre become circles.
/// The angle is measured from the nearest axis, so that coordinates near zero do not cancel.
#[inline(always)]
pub fn sample_concentric_disk(u: Vec2) -> Vec2 {
    let a = u.x * 2.0 - 1.0;
    let b = u.y * 2.0 - 1.0;
    let swap = num::abs(b) >= num::abs(a);
    let (radius, along) = if swap { (b, a) } else { (a, b) };
    let slope = num::div(along, if radius == 0.0 { 1.0 } else { radius });
    let (sin, cos) = num::sin_cos(slope * 0.125);
    let (major, minor) = (radius * cos, radius * sin);
    if swap { Vec2::new(minor, major) } else { Vec2::new(major, minor) }
}

/// 1 / pi, the density over the area of the unit disk.
#[inline(always)]
pub fn concentric_disk_pdf() -> f32 {
    num::INV_PI
}

/// The `u` of which [`sample_concentric_disk`] makes the point `p`.
#[inline(always)]
pub fn invert_concentric_disk(p: Vec2) -> Vec2 {
    let swap = num::abs(p.y) >= num::abs(p.x);
    let (major, minor) = if swap { (p.y, p.x) } else { (p.x, p.y) };
    let sign = if major < 0.0 { -1.0 } else { 1.0 };
    let radius = num::sqrt(major * major + minor * minor) * sign;
    let along = radius * (8.0 * num::atan2(minor * sign, major * sign));
    let (a, b) = if swap { (along, radius) } else { (radius, along) };
    Vec2::new(to_unit(0.5 * a + 0.5), to_unit(0.5 * b + 0.5))
}
