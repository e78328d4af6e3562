//! Points on triangles.

use super::to_unit;
use crate::num;
use glam::Vec2;

/// Barycentric coordinates of the second and third vertex, uniform over the triangle; `u` in [0, 1)^2.
///
/// Heitz 2019, "A Low-Distortion Map Between Triangle and Square": no square root, and continuous.
#[inline(always)]
pub fn sample_triangle(u: Vec2) -> Vec2 {
    if u.y > u.x {
        let x = u.x * 0.5;
        Vec2::new(x, u.y - x)
    } else {
        let y = u.y * 0.5;
        Vec2::new(u.x - y, y)
    }
}

/// The density of [`sample_triangle`] over the surface, for a triangle of the given positive area.
#[inline(always)]
pub fn triangle_pdf(area: f32) -> f32 {
    num::recip(area)
}

/// The `u` of which [`sample_triangle`] makes the barycentric coordinates `b`.
#[inline(always)]
pub fn invert_triangle(b: Vec2) -> Vec2 {
    let u = if b.y > b.x { Vec2::new(b.x * 2.0, b.y + b.x) } else { Vec2::new(b.x + b.y, b.y * 2.0) };
    Vec2::new(to_unit(u.x), to_unit(u.y))
}
