//! A wide slab of a scattering medium, one mean free path thick, under a sky that is white above the horizon: as bright as what is
//! reflected is every pixel, and as what is transmitted, seen from below.

use glam::DVec3;

use super::parts::{sky, stage, waxy};
use crate::scene::{Mesh, Scene, Volume};

/// Light that enters far from the border does not reach it.
const SIDE: f64 = 80.0;
/// What a half space reflects of the medium that scatters 0.9 of a collision.
const COLOR: [f32; 3] = [0.477_170_1; 3];

pub(super) fn scene() -> Scene {
    let mut scene = stage("slab", [DVec3::new(0.0, 6.0, 0.0), DVec3::new(0.3, 0.0, 0.1)], 40.0, [64, 64]);
    scene.environment = Some(sky("above", [4, 256], |direction| if direction.y > 0.0 { [1.0; 3] } else { [0.0; 3] }));
    let medium = scene.add_material(waxy("medium", Volume::scattering(COLOR, [1.0; 3], 0.0)));
    let half = 0.5 * SIDE;
    scene.add_mesh("slab", medium, Mesh::cuboid(DVec3::new(-half, -1.0, -half), DVec3::new(half, 0.0, half)));
    scene
}

#[cfg(test)]
mod tests {
    use restir_shared::glam::Vec3;
    use restir_shared::medium::Medium;

    use super::*;

    #[test]
    fn nine_tenths_of_a_collision_are_scattered() {
        let medium = Medium::of_color(Vec3::from_array(COLOR), Vec3::ONE, 0.0);
        assert!((medium.albedo.x - 0.9).abs() < 1.0e-6, "{medium:?}");
        let extinction = Volume::scattering(COLOR, [1.0; 3], 0.0).extinction();
        assert!(extinction.iter().all(|rate| (rate - 1.0).abs() < 1.0e-6), "{extinction:?}");
    }
}
