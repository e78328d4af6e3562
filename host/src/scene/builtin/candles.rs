//! Candles that burn inside of their wax: lights inside of bodies that scatter, a glass of milk, and a pebble that light does not pass, in
//! wax, too.

use glam::{DAffine3, DVec3};

use super::parts::{IOR, checkered_floor, ground, sky, stage, waxy};
use crate::scene::subsurface::medium;
use crate::scene::{Material, Mesh, Scene, Volume, VolumeScattering};

/// A millimetre: candles are a decimetre high.
const MILLIMETRE: f64 = 0.01;

pub(super) fn scene() -> Scene {
    let mut scene = stage("candles", [DVec3::new(0.5, 1.5, 4.2), DVec3::new(0.0, 0.55, 0.0)], 30.0, [640, 480]);
    scene.environment = Some(sky("night", [32, 16], |direction| {
        let up = 0.5 + 0.5 * direction.y as f32;
        [0.012, 0.016, 0.028].map(|channel| channel * (0.4 + up))
    }));
    let squares = checkered_floor(&mut scene, [170, 110], [16.0, 16.0]);
    scene.add_mesh("table", squares, ground(8.0));
    let wax = |name: &str, medium_of: &str| waxy(name, medium(medium_of, MILLIMETRE).expect("a medium that there is"));
    let pale = scene.add_material(wax("wax", "wax"));
    let red = scene.add_material(wax("red wax", "skin1"));
    let white = scene.add_material(wax("stearin", "marble"));
    add_candle(&mut scene, pale, [-0.75, 0.1], [0.33, 1.15], [6.0, 3.6, 1.5]);
    add_candle(&mut scene, red, [0.05, -0.35], [0.27, 0.85], [9.0, 4.8, 2.0]);
    add_candle(&mut scene, white, [0.72, 0.3], [0.3, 0.6], [4.8, 3.0, 1.4]);
    add_milk(&mut scene);
    let pebble = scene.add_material(Material::diffuse("pebble", [0.12, 0.1, 0.09]));
    scene.add_mesh("pebble", pebble, Mesh::sphere(DVec3::new(-0.58, 0.7, 0.26), 0.07, 3));
    scene
}

/// A candle with a round rim and a light in its upper part; where it stands, its radius and height, and the light's radiance.
fn add_candle(scene: &mut Scene, wax: usize, [x, z]: [f64; 2], [radius, height]: [f64; 2], radiance: [f32; 3]) {
    const STEPS: u32 = 8;
    let rim = 0.18 * radius;
    let arc = (0..=STEPS).map(|i| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * f64::from(i) / f64::from(STEPS)).sin_cos();
        [radius - rim + rim * cos, height - rim + rim * sin]
    });
    let bottom = [[0.0, 0.001], [radius, 0.001], [radius, 0.001]];
    let profile: Vec<[f64; 2]> = bottom.into_iter().chain(arc).chain([[0.0, height]]).collect();
    let place = DAffine3::from_translation(DVec3::new(x, 0.0, z));
    scene.place_mesh("candle", wax, Mesh::lathe(&profile, 64), place);
    scene.add_sphere_light(DVec3::new(x, height - 0.75 * radius, z), 0.45 * radius, radiance);
}

/// A block of milk with a smooth surface, in which light goes on rather than back.
fn add_milk(scene: &mut Scene) {
    let still = medium("milk", MILLIMETRE).expect("a medium that there is");
    let scattering = still.scattering.map(|scattering| VolumeScattering { anisotropy: 0.6, ..scattering });
    let liquid = Material {
        transmission: 1.0,
        roughness: 0.0,
        ior: IOR,
        volume: Some(Volume { scattering, ..still }),
        ..Material::diffuse("milk", [1.0; 3])
    };
    let milk = scene.add_material(liquid);
    let at = DAffine3::from_translation(DVec3::new(0.2, 0.001, 0.85)) * DAffine3::from_rotation_y(0.5);
    scene.place_mesh("milk", milk, Mesh::cuboid(DVec3::new(-0.16, 0.0, -0.16), DVec3::new(0.16, 0.3, 0.16)), at);
}
