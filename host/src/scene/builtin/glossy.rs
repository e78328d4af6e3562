//! A corridor whose surfaces grow rougher with the distance: where reconnection of paths fails near the camera and works
//! far away.

use glam::DVec3;

use super::parts::{metal, plastic, stage};
use crate::scene::{Material, Mesh, Scene};

/// The roughness of each bay, from the camera on.
const ROUGHNESS: [f32; 8] = [0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5];

// Lengths are in metres.

/// Length of a bay.
const BAY: f64 = 2.0;
const HALF_WIDTH: f64 = 1.5;
const HEIGHT: f64 = 2.6;
/// The corridor begins behind the camera.
const BEGIN: f64 = 3.0;
const END: f64 = -BAY * ROUGHNESS.len() as f64;

pub(super) fn scene() -> Scene {
    let mut scene = stage("glossy", [DVec3::new(0.25, 1.35, 2.6), DVec3::new(-0.1, 1.1, -6.0)], 52.0, [640, 480]);
    add_shell(&mut scene);
    for (bay, &roughness) in ROUGHNESS.iter().enumerate() {
        add_bay(&mut scene, -BAY * bay as f64, roughness);
    }
    for (index, z) in [0.0, -4.0, -8.0, -12.0].into_iter().enumerate() {
        let radiance = [[14.0, 11.5, 8.5], [8.0, 10.5, 14.0]][index % 2];
        let corner = DVec3::new(-0.7, HEIGHT - 0.01, z - 0.4);
        scene.add_quad_light(corner, [DVec3::X * 1.4, DVec3::Z * 0.3], radiance, false);
    }
    scene
}

/// What is alike all along: the ceiling, the ends, and the walls behind the camera.
fn add_shell(scene: &mut Scene) {
    let white = scene.add_material(Material::diffuse("white", [0.75; 3]));
    let red = scene.add_material(Material::diffuse("end", [0.7, 0.16, 0.1]));
    let (x, y, z) = (DVec3::X * 2.0 * HALF_WIDTH, DVec3::Y * HEIGHT, DVec3::Z * BEGIN);
    let lo = DVec3::new(-HALF_WIDTH, 0.0, 0.0);
    let hi = DVec3::new(HALF_WIDTH, HEIGHT, BEGIN);
    let ceiling = Mesh::quad(hi, [-x, DVec3::Z * (END - BEGIN)]);
    let behind = [(lo, [y, z]), (hi, [-z, -y]), (hi, [-y, -x]), (lo, [z, x])];
    scene.add_mesh("ceiling", white, ceiling);
    scene.add_mesh("behind", white, Mesh::union(&behind.map(|(corner, edges)| Mesh::quad(corner, edges))));
    scene.add_mesh("end", red, Mesh::quad(DVec3::new(-HALF_WIDTH, 0.0, END), [x, y]));
}

/// Two metres of corridor: metal on the left, plastic on the right and below, and a sphere of each on a pedestal.
fn add_bay(scene: &mut Scene, front: f64, roughness: f32) {
    let steel = scene.add_material(metal("metal", [0.92, 0.87, 0.78], roughness));
    let blue = scene.add_material(plastic("plastic", [0.1, 0.24, 0.5], roughness));
    let tiles = [0.55, 0.12].map(|grey| scene.add_material(plastic("tile", [grey; 3], roughness)));
    let (y, z) = (DVec3::Y * HEIGHT, DVec3::Z * BAY);
    let back = front - BAY;
    scene.add_mesh("left wall", steel, Mesh::quad(DVec3::new(-HALF_WIDTH, 0.0, back), [y, z]));
    scene.add_mesh("right wall", blue, Mesh::quad(DVec3::new(HALF_WIDTH, 0.0, back), [z, y]));
    for (parity, material) in tiles.into_iter().enumerate() {
        scene.add_mesh("floor", material, squares(back, parity));
    }
    for (x, material) in [(-0.95, blue), (0.95, steel)] {
        let middle = DVec3::new(x, 0.0, back + 0.5 * BAY);
        let half = DVec3::new(0.17, 0.0, 0.17);
        scene.add_mesh("pedestal", tiles[0], Mesh::cuboid(middle - half, middle + half + DVec3::Y * 0.55));
        scene.add_mesh("sphere", material, Mesh::sphere(middle + DVec3::Y * 0.851, 0.3, 4));
    }
}

/// The squares of one colour of a bay's checkered floor, half a metre wide.
fn squares(back: f64, parity: usize) -> Mesh {
    const SIDE: f64 = 0.5;
    let place = |i: usize, k: usize| DVec3::new(-HALF_WIDTH + SIDE * i as f64, 0.0, back + SIDE * k as f64);
    let all = (0..6).flat_map(|i| (0..4).map(move |k| (i, k)));
    let squares = all.filter(|(i, k)| (i + k) % 2 == parity);
    let square = |(i, k)| Mesh::quad(place(i, k), [DVec3::Z * SIDE, DVec3::X * SIDE]);
    Mesh::union(&squares.map(square).collect::<Vec<_>>())
}
