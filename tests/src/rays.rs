//! Rays that are hard to intersect.

use crate::brute::Triangles;
use crate::random::SplitMix;
use glam::Vec3;
use restir_shared::geometry::Ray;

/// How many kinds of ray [`adversarial`] knows.
pub const KINDS: usize = 12;

fn vector(random: &mut SplitMix, scale: f64) -> Vec3 {
    let mut one = || (scale * random.range(-1.0, 1.0)) as f32;
    Vec3::new(one(), one(), one())
}

/// A point of the triangle exactly at a vertex, close to the middle of an edge, or inside.
fn target(random: &mut SplitMix, [a, b, c]: [Vec3; 3]) -> Vec3 {
    match random.below(4) {
        0 => a,
        1 => (a + b) * 0.5,
        2 => a + (b - a) * random.unit() as f32,
        _ => {
            let (u, v) = (random.unit() as f32, random.unit() as f32);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            a + (b - a) * u + (c - a) * v
        }
    }
}

/// A ray at random triangles of the mesh: at edges and vertices, along axes, within planes of triangles and of boxes,
/// from far away, from on the surface, with directions and limits of all magnitudes.
pub fn adversarial(triangles: &Triangles, random: &mut SplitMix) -> Ray {
    let corners = triangles.get(random.below(triangles.len()));
    let at = target(random, corners);
    let another = triangles.get(random.below(triangles.len()));
    let other = target(random, another);
    let extent = f64::from(triangles.extent());
    let axis = [Vec3::X, Vec3::Y, Vec3::Z][random.below(3)];
    let near = at + vector(random, extent);
    let segment = |origin: Vec3, end: Vec3| (origin, end - origin);
    let (origin, direction) = match random.below(KINDS) {
        0 => segment(near, at),
        // exactly along an axis, through an exact coordinate
        1 => (at - axis * extent as f32, axis),
        2 => (at + axis * extent as f32, -axis),
        // almost along an axis
        3 => (at - axis * extent as f32, axis + vector(random, 1.0e-7)),
        // within the plane of a triangle
        4 => (corners[0] * 2.0 - corners[1], corners[1] - corners[0]),
        // from one point of the surface to another
        5 => segment(other, at),
        // from far away
        6 => segment(at + vector(random, extent * 1.0e4), at),
        7 => segment(at + axis * (extent * 1.0e7) as f32, at),
        // within the planes of two faces of a box
        8 => (Vec3::new(at.x, at.y, near.z), Vec3::Z),
        9 => (Vec3::new(at.x, near.y, near.z), Vec3::new(0.0, at.y - near.y, at.z - near.z)),
        10 => (near, vector(random, 1.0)),
        // away from the mesh
        _ => (at, at - near),
    };
    let direction = direction * f64::exp2(random.range(-20.0, 20.0).round()) as f32;
    let direction = if direction.abs().max_element() < 1.0e-9 { axis } else { direction };
    let t_max = match random.below(4) {
        // the end of a segment, where a hit must not count
        0 => 1.0,
        1 => random.range(0.0, 2.0) as f32,
        _ => Ray::FAR,
    };
    Ray { origin, direction, t_max, key: random.below(4) as u32 }
}
