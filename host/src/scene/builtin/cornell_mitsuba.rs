//! The Cornell box with exactly the numbers of Mitsuba 3's `mi.cornell_box()`.
//!
//! One difference remains: Mitsuba's diffuse surfaces are black from behind. It concerns only the back of the light,
//! which is 0.01 below the ceiling.

use glam::{DAffine3, DVec3};

use super::parts::stage;
use super::{CUBE, quads};
use crate::scene::{Material, Scene};

/// Mitsuba's shape `rectangle`: from -1 to 1 in x and y, facing +z.
const RECTANGLE: [[f64; 3]; 4] = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];

pub(super) fn scene() -> Scene {
    let mut scene = stage("cornell-mitsuba", [DVec3::new(0.0, 0.0, 3.9), DVec3::ZERO], 39.3077, [256, 256]);
    let grey = [0.885809, 0.698859, 0.666422];
    let [white, green, red, light] = [
        Material::diffuse("white", grey),
        Material::diffuse("green", [0.105421, 0.37798, 0.076425]),
        Material::diffuse("red", [0.570068, 0.0430135, 0.0443706]),
        Material::emitter("light", grey, [18.387, 13.9873, 6.75357]),
    ]
    .map(|material| scene.add_material(material));
    for (name, material, shape, transform) in [
        ("light", light, &[RECTANGLE][..], at(0.0, 0.99, 0.01) * around_x(90.0) * scale(0.23, 0.19, 0.19)),
        ("floor", white, &[RECTANGLE], at(0.0, -1.0, 0.0) * around_x(-90.0)),
        ("ceiling", white, &[RECTANGLE], at(0.0, 1.0, 0.0) * around_x(90.0)),
        ("back", white, &[RECTANGLE], at(0.0, 0.0, -1.0)),
        ("green-wall", green, &[RECTANGLE], at(1.0, 0.0, 0.0) * around_y(-90.0)),
        ("red-wall", red, &[RECTANGLE], at(-1.0, 0.0, 0.0) * around_y(90.0)),
        ("small-box", white, &CUBE, at(0.335, -0.7, 0.38) * around_y(-17.0) * scale(0.3, 0.3, 0.3)),
        ("large-box", white, &CUBE, at(-0.33, -0.4, -0.28) * around_y(18.25) * scale(0.3, 0.61, 0.3)),
    ] {
        scene.place_mesh(name, material, quads(shape), transform);
    }
    scene
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

fn around_x(degrees: f64) -> DAffine3 {
    DAffine3::from_rotation_x(degrees.to_radians())
}

fn around_y(degrees: f64) -> DAffine3 {
    DAffine3::from_rotation_y(degrees.to_radians())
}

fn scale(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_scale(DVec3::new(x, y, z))
}
