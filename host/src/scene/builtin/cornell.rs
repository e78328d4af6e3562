//! The Cornell box from the measured geometry that Cornell University publishes, with the RGB reflectances that are
//! in common use for its spectra.

use glam::DVec3;

use super::quads;
use crate::scene::{Camera, Material, Scene};

/// The data is in millimetres; a unit of the scene is half the width of the box.
const SCALE: f64 = 1.0 / 278.0;

/// The middle of the box in the data's coordinates.
const CENTRE: [f64; 3] = [278.0, 274.4, 279.6];

const FLOOR: [[f64; 3]; 4] = [[552.8, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 559.2], [549.6, 0.0, 559.2]];
/// The published light lies in the plane of the ceiling: it is lowered by half a millimetre to be in front of it.
const LIGHT: [[f64; 3]; 4] =
    [[343.0, 548.3, 227.0], [343.0, 548.3, 332.0], [213.0, 548.3, 332.0], [213.0, 548.3, 227.0]];
const CEILING: [[f64; 3]; 4] = [[556.0, 548.8, 0.0], [556.0, 548.8, 559.2], [0.0, 548.8, 559.2], [0.0, 548.8, 0.0]];
const BACK: [[f64; 3]; 4] = [[549.6, 0.0, 559.2], [0.0, 0.0, 559.2], [0.0, 548.8, 559.2], [556.0, 548.8, 559.2]];
const RIGHT: [[f64; 3]; 4] = [[0.0, 0.0, 559.2], [0.0, 0.0, 0.0], [0.0, 548.8, 0.0], [0.0, 548.8, 559.2]];
const LEFT: [[f64; 3]; 4] = [[552.8, 0.0, 0.0], [549.6, 0.0, 559.2], [556.0, 548.8, 559.2], [556.0, 548.8, 0.0]];
const SHORT_BLOCK: [[f64; 3]; 4] =
    [[130.0, 165.0, 65.0], [82.0, 165.0, 225.0], [240.0, 165.0, 272.0], [290.0, 165.0, 114.0]];
const TALL_BLOCK: [[f64; 3]; 4] =
    [[423.0, 330.0, 247.0], [265.0, 330.0, 296.0], [314.0, 330.0, 456.0], [472.0, 330.0, 406.0]];

pub(super) fn scene() -> Scene {
    let position = DVec3::from_array(place([278.0, 273.0, -800.0]));
    // A focal length of 35 mm and a film 25 mm high.
    let vertical_fov = 2.0 * (0.0125_f64 / 0.035).atan();
    let mut scene = Scene {
        name: "cornell".to_owned(),
        camera: Some(Camera::pinhole(position, position - DVec3::Z, DVec3::Y, vertical_fov)),
        default_size: Some([512, 512]),
        ..Scene::default()
    };
    let [white, red, green, light] = [
        Material::diffuse("white", [0.725, 0.71, 0.68]),
        Material::diffuse("red", [0.63, 0.065, 0.05]),
        Material::diffuse("green", [0.14, 0.45, 0.091]),
        Material::emitter("light", [0.78, 0.78, 0.78], [17.0, 12.0, 4.0]),
    ]
    .map(|material| scene.add_material(material));
    for (name, material, faces) in [
        ("floor", white, &[FLOOR][..]),
        ("ceiling", white, &[CEILING]),
        ("back wall", white, &[BACK]),
        ("right wall", green, &[RIGHT]),
        ("left wall", red, &[LEFT]),
        ("short block", white, &block(SHORT_BLOCK)),
        ("tall block", white, &block(TALL_BLOCK)),
        ("light", light, &[LIGHT]),
    ] {
        let placed: Vec<_> = faces.iter().map(|face| face.map(place)).collect();
        scene.add_mesh(name, material, quads(&placed));
    }
    scene
}

/// From the data's coordinates to the scene's: centred, scaled, and turned half around the vertical so that the
/// camera looks along -z.
fn place([x, y, z]: [f64; 3]) -> [f64; 3] {
    [(CENTRE[0] - x) * SCALE, (y - CENTRE[1]) * SCALE, (CENTRE[2] - z) * SCALE]
}

/// The top of a block and the walls below its edges; the blocks have no bottom.
fn block(top: [[f64; 3]; 4]) -> [[[f64; 3]; 4]; 5] {
    let wall = |i: usize, j: usize| {
        let (a, b) = (top[i], top[j]);
        [[a[0], 0.0, a[2]], a, b, [b[0], 0.0, b[2]]]
    };
    [top, wall(1, 0), wall(2, 1), wall(3, 2), wall(0, 3)]
}
