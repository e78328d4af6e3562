//! A hare in the colour of wax: one closed mesh of organic shape with parts from 1 % (ears, fingers) to 40 % (belly) of its height thick.

use glam::{DQuat, DVec3};

use super::isosurface::isosurface;
use super::parts::{ground, plastic, sky, stage};
use crate::scene::{Material, Mesh, Scene};

/// Side of the grid's cubes; the hare is 2 high.
const CELL: f64 = 0.016;

pub(super) fn scene() -> Scene {
    let mut scene = stage("statue", [DVec3::new(1.35, 1.5, 4.6), DVec3::new(0.0, 0.98, 0.0)], 30.0, [480, 640]);
    scene.environment = Some(sky("studio", [32, 16], |direction| {
        let up = 0.5 + 0.5 * direction.y as f32;
        [0.05 + 0.06 * up, 0.06 + 0.08 * up, 0.08 + 0.12 * up]
    }));
    let wax = scene.add_material(plastic("wax", [0.86, 0.68, 0.52], 0.4));
    let floor = scene.add_material(Material::diffuse("floor", [0.45, 0.44, 0.42]));
    scene.add_mesh("statue", wax, hare(CELL));
    scene.add_mesh("floor", floor, ground(14.0));
    // the large one from the left in front; a bright one from behind, which shines through ears and fingers
    let key = [DVec3::new(1.0, 0.0, 1.0), DVec3::new(-0.45, -1.0, 0.45)];
    scene.add_quad_light(DVec3::new(-2.8, 3.7, 1.2), key.map(|edge| edge * 1.1), [11.0, 10.0, 8.8], false);
    let rim = [DVec3::new(0.0, -0.8, -0.5), DVec3::new(-1.0, 0.0, 0.4)];
    scene.add_quad_light(DVec3::new(1.9, 3.1, -1.9), rim, [16.0, 17.0, 20.0], false);
    scene
}

/// The hare from cubes of that side.
pub(super) fn hare(cell: f64) -> Mesh {
    isosurface(distance, DVec3::new(-0.8, -0.05, -0.62), DVec3::new(0.8, 2.12, 0.62), cell)
}

/// Negative inside. Parts are joined by a smooth minimum; all is symmetric in x but for the pose of ears and arms.
fn distance(p: DVec3) -> f64 {
    let side = if p.x < 0.0 { -1.0 } else { 1.0 };
    let q = DVec3::new(p.x.abs(), p.y, p.z);
    let mut d = ellipsoid(p, DVec3::new(0.0, 0.56, 0.0), DVec3::new(0.39, 0.46, 0.36));
    let mut join = |part: f64, radius: f64| d = smooth_min(d, part, radius);
    join(ellipsoid(p, DVec3::new(0.0, 0.98, 0.02), DVec3::new(0.25, 0.27, 0.21)), 0.12);
    join(head(p, q), 0.06);
    join(leg(q), 0.05);
    join(sphere(p, DVec3::new(0.0, 0.34, -0.42), 0.12), 0.04);
    join(arm(q, side), 0.05);
    // a navel
    smooth_max(d, -sphere(p, DVec3::new(0.0, 0.58, 0.385), 0.028), 0.02)
}

fn head(p: DVec3, q: DVec3) -> f64 {
    let mut d = ellipsoid(p, DVec3::new(0.0, 1.36, 0.05), DVec3::new(0.215, 0.205, 0.225));
    d = smooth_min(d, ellipsoid(q, DVec3::new(0.07, 1.265, 0.235), DVec3::new(0.085, 0.07, 0.075)), 0.05);
    d = smooth_min(d, sphere(p, DVec3::new(0.0, 1.325, 0.305), 0.028), 0.012);
    // sockets, and eyes in them
    d = smooth_max(d, -sphere(q, DVec3::new(0.105, 1.415, 0.265), 0.052), 0.02);
    d = smooth_min(d, sphere(q, DVec3::new(0.1, 1.412, 0.232), 0.045), 0.006);
    smooth_min(d, ear(p, q), 0.03)
}

/// A leaf hollowed in front; the hare's left one hangs outwards a little more.
fn ear(p: DVec3, q: DVec3) -> f64 {
    let lean = if p.x < 0.0 { 0.3 } else { 0.16 };
    let root = DVec3::new(0.1, 1.5, 0.02);
    let local = DQuat::from_rotation_z(lean) * (q - root);
    let leaf = ellipsoid(local, DVec3::new(0.0, 0.27, 0.0), DVec3::new(0.092, 0.3, 0.042));
    let hollow = ellipsoid(local, DVec3::new(0.0, 0.28, 0.034), DVec3::new(0.074, 0.25, 0.046));
    smooth_max(leaf, -hollow, 0.012)
}

fn leg(q: DVec3) -> f64 {
    let thigh = ellipsoid(q, DVec3::new(0.25, 0.3, 0.1), DVec3::new(0.17, 0.25, 0.24));
    let foot = ellipsoid(q, DVec3::new(0.24, 0.085, 0.26), DVec3::new(0.115, 0.08, 0.27));
    let mut d = smooth_min(thigh, foot, 0.05);
    for x in [0.17, 0.24, 0.31] {
        d = smooth_min(d, sphere(q, DVec3::new(x, 0.075, 0.5), 0.045), 0.02);
    }
    d
}

/// From the shoulder over the elbow to a hand with spread fingers; the hare's right one is raised higher.
fn arm(q: DVec3, side: f64) -> f64 {
    let lift = if side < 0.0 { 0.16 } else { 0.0 };
    let shoulder = DVec3::new(0.19, 1.1, 0.02);
    let elbow = DVec3::new(0.46, 0.92 + 0.3 * lift, 0.1);
    let wrist = DVec3::new(0.53, 1.12 + lift, 0.27);
    let mut d = smooth_min(cone(q, shoulder, elbow, [0.09, 0.062]), cone(q, elbow, wrist, [0.06, 0.04]), 0.03);
    let palm = wrist + DVec3::new(0.012, 0.075, 0.02);
    d = smooth_min(d, ellipsoid(q, palm, DVec3::new(0.06, 0.075, 0.03)), 0.03);
    for (spread, length) in [(-0.5, 0.115), (-0.16, 0.145), (0.18, 0.14), (0.52, 0.11)] {
        let (sin, cos) = f64::sin_cos(spread);
        let root = palm + DVec3::new(0.055 * spread / 0.4, 0.045, 0.0);
        d = smooth_min(d, cone(q, root, root + length * DVec3::new(sin, cos, 0.12), [0.018, 0.012]), 0.008);
    }
    let thumb = palm + DVec3::new(-0.04, -0.02, 0.01);
    smooth_min(d, cone(q, thumb, thumb + DVec3::new(-0.085, 0.05, 0.03), [0.022, 0.014]), 0.012)
}

fn sphere(p: DVec3, centre: DVec3, radius: f64) -> f64 {
    (p - centre).length() - radius
}

/// Not the distance, but of its sign and near it close to it.
fn ellipsoid(p: DVec3, centre: DVec3, radii: DVec3) -> f64 {
    let local = p - centre;
    let scaled = (local / radii).length();
    let slope = (local / (radii * radii)).length();
    if slope > 0.0 { scaled * (scaled - 1.0) / slope } else { -radii.min_element() }
}

/// A capsule from `a` to `b` whose radius changes along the way.
fn cone(p: DVec3, a: DVec3, b: DVec3, radii: [f64; 2]) -> f64 {
    let axis = b - a;
    let t = ((p - a).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
    (p - a - t * axis).length() - (radii[0] + t * (radii[1] - radii[0]))
}

/// The minimum, rounded where the two differ by less than `radius` (Quilez, "Smooth minimum", quadratic).
fn smooth_min(a: f64, b: f64, radius: f64) -> f64 {
    let h = (radius - (a - b).abs()).max(0.0) / radius;
    a.min(b) - 0.25 * radius * h * h
}

fn smooth_max(a: f64, b: f64, radius: f64) -> f64 {
    -smooth_min(-a, -b, radius)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::scene::double;

    #[test]
    fn the_hare_is_one_closed_oriented_surface_of_good_triangles() {
        let hare = hare(CELL);
        assert!(hare.indices.len() >= 50_000, "{}", hare.indices.len());
        assert!(hare.is_closed());
        assert!(is_in_one_piece(&hare));
        // no handle: Euler's characteristic of a sphere, with three half-edges a triangle
        assert_eq!(2 * hare.positions.len() - hare.indices.len(), 4);
        assert!(hare.normals.iter().all(|&normal| (double(normal).length() - 1.0).abs() < 1e-6));
        for [p, q, r] in hare.triangles() {
            assert!((q - p).cross(r - p).length() > 1e-3 * CELL * CELL, "no area: {p} {q} {r}");
        }
        let volume = hare.triangles().map(|[p, q, r]| p.cross(q).dot(r) / 6.0).sum::<f64>();
        assert!(volume > 0.2, "front sides are out: {volume}");
    }

    /// Whether all vertices are reached from the first along triangles.
    fn is_in_one_piece(mesh: &Mesh) -> bool {
        let (mut reached, mut before) = (HashSet::from([0]), 0);
        while reached.len() > before {
            before = reached.len();
            for triangle in &mesh.indices {
                if triangle.iter().any(|i| reached.contains(i)) {
                    reached.extend(triangle);
                }
            }
        }
        reached.len() == mesh.positions.len()
    }

    #[test]
    fn it_is_thick_and_thin() {
        let [lo, hi] =
            hare(CELL).positions.iter().fold([f32::MAX, f32::MIN], |[lo, hi], p| [lo.min(p[1]), hi.max(p[1])]);
        let height = f64::from(hi - lo);
        let thickness = |from: DVec3, way: DVec3| {
            let steps = 4000;
            let inside = |i: &i32| distance(from + way * (f64::from(*i) / f64::from(steps))) < 0.0;
            (0..steps).filter(inside).count() as f64 / f64::from(steps) * way.length() / height
        };
        let belly = thickness(DVec3::new(-0.6, 0.56, 0.0), DVec3::X * 1.2);
        let ear = thickness(DVec3::new(-0.22, 1.8, -0.1), DVec3::Z * 0.2);
        assert!(belly > 0.35 && ear > 0.003 && ear < 0.02, "{belly} {ear}");
    }
}
