//! A light for scenes that have none.

use glam::{DAffine3, DVec3};

use super::{Instance, Material, Mesh, Scene, camera::centre_and_half_size};

/// Radiance of the default light. A white horizontal surface at the top of the scene, under the middle of the light,
/// then has a radiance near 1: the light covers 0.36 of its cosine-weighted hemisphere.
const RADIANCE: f32 = 2.8;

/// Height of the light above the top of the scene, in radii of the scene.
const HEIGHT: f64 = 1.5;

/// How far the light is moved to the front (+z), in radii of the scene: the side that a framed camera sees is lit.
const TO_THE_FRONT: f64 = 0.5;

impl Scene {
    /// Adds a square light that faces down, above the scene's bounds and a little to their front.
    ///
    /// Its half side is the radius of the bounds and its radiance is such that a white object is well exposed. It is
    /// above what [`super::Camera::framing`] sees. It reflects nothing.
    pub fn add_default_light(&mut self) {
        let bounds = self.bounds();
        let (centre, half) = centre_and_half_size(bounds);
        let radius = half.length();
        let position = centre + DVec3::new(0.0, half.y + HEIGHT * radius, TO_THE_FRONT * radius);
        self.instances.push(Instance {
            mesh: self.meshes.len(),
            transform: DAffine3::from_translation(position) * DAffine3::from_scale(DVec3::splat(radius)),
        });
        self.meshes.push(Mesh {
            name: "default light".to_owned(),
            positions: vec![[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]],
            indices: vec![[0, 1, 2], [0, 2, 3]],
            material: self.materials.len(),
        });
        self.materials.push(Material {
            name: "default light".to_owned(),
            reflectance: [0.0; 3],
            emission: [RADIANCE; 3],
            two_sided_emission: false,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_above_the_scene_and_faces_down() {
        let mut scene = Scene {
            meshes: vec![Mesh {
                positions: vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
                indices: vec![[0, 1, 2]],
                ..Mesh::default()
            }],
            instances: vec![Instance {
                mesh: 0,
                transform: DAffine3::IDENTITY,
            }],
            materials: vec![Material {
                name: String::new(),
                reflectance: [0.5; 3],
                emission: [0.0; 3],
                two_sided_emission: false,
            }],
            ..Scene::default()
        };
        assert!(!scene.has_light());
        scene.add_default_light();
        assert!(scene.has_light());
        let light = scene.instances[1];
        let corner = |i: usize| {
            let [x, y, z] = scene.meshes[light.mesh].positions[i].map(f64::from);
            light.transform.transform_point3(DVec3::new(x, y, z))
        };
        assert!(corner(0).y > 2.0);
        assert!((corner(1) - corner(0)).cross(corner(2) - corner(0)).y < 0.0);
    }

    #[test]
    fn an_empty_scene_gets_one_too() {
        let mut scene = Scene::default();
        scene.add_default_light();
        assert!(scene.has_light() && scene.instances[0].transform.is_finite());
    }
}
