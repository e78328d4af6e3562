//! A closed box from inside, whose radiance is known: with emission `Le`, reflectance `rho` and paths of at most `n`
//! segments it is `Le (1 - rho^n) / (1 - rho)` in every direction.

use glam::DVec3;

use super::parts::stage;
use super::{CUBE, quads};
use crate::scene::{Material, Scene};

pub(super) fn scene() -> Scene {
    let mut scene = stage("furnace", [DVec3::new(0.2, 0.1, 0.7), DVec3::new(-0.3, -0.2, -1.0)], 80.0, [64, 64]);
    let walls = scene.add_material(Material::emitter("walls", [0.5; 3], [1.0; 3]));
    scene.add_mesh("walls", walls, quads(&CUBE.map(|[a, b, c, d]| [d, c, b, a])));
    scene
}
