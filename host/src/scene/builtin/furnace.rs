//! A closed box from inside, whose radiance is known: with emission `Le`, reflectance `rho` and paths of at most `n`
//! segments it is `Le (1 - rho^n) / (1 - rho)` in every direction.

use glam::DVec3;

use super::{CUBE, in_place, quads};
use crate::scene::{Camera, Material, Scene};

pub(super) fn scene() -> Scene {
    let inwards = CUBE.map(|[a, b, c, d]| [d, c, b, a]);
    let meshes = vec![quads("walls", 0, &inwards)];
    Scene {
        name: "furnace".to_owned(),
        instances: in_place(&meshes),
        meshes,
        materials: vec![Material::emitter("walls", [0.5; 3], [1.0; 3])],
        camera: Some(Camera::pinhole(
            DVec3::new(0.2, 0.1, 0.7),
            DVec3::new(-0.3, -0.2, -1.0),
            DVec3::Y,
            80.0_f64.to_radians(),
        )),
        default_size: Some([64, 64]),
        ..Scene::default()
    }
}
