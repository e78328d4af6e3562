//! A light for scenes that have none.

use glam::{DAffine3, DVec3};

use super::{Instance, Material, Mesh, Scene, camera::centre_and_half_size};

// Lengths are in radii of the scene's bounds.

/// Half the side of the light.
const HALF_SIDE: f64 = 1.5;

/// Height of the light above the top of the scene.
const HEIGHT: f64 = 1.5;

/// How far the light is moved to the front (+z): the side that a framed camera sees is lit.
const TO_THE_FRONT: f64 = 1.2;

/// Radiance of the light. It covers 0.41 of the cosine-weighted hemisphere of a horizontal surface at the top of the
/// scene, and 0.20 of that of a surface in the middle that faces a framed camera: if they are white, their radiance is
/// 1.0 and 0.5.
const RADIANCE: f32 = 2.5;

impl Scene {
    /// Adds a square light that faces down, above the scene's bounds and a little to their front.
    ///
    /// Its size follows the bounds and its radiance is such that a white object is well exposed. A camera made by
    /// [`super::Camera::framing`] sees nothing of it. It reflects nothing.
    pub fn add_default_light(&mut self) {
        let bounds = self.bounds();
        let (centre, half) = centre_and_half_size(bounds);
        let radius = half.length();
        let position = centre + DVec3::new(0.0, half.y + HEIGHT * radius, TO_THE_FRONT * radius);
        self.instances.push(Instance {
            mesh: self.meshes.len(),
            transform: DAffine3::from_translation(position) * DAffine3::from_scale(DVec3::splat(HALF_SIDE * radius)),
        });
        self.meshes.push(Mesh {
            name: "default light".to_owned(),
            positions: vec![[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]],
            indices: vec![[0, 1, 2], [0, 2, 3]],
            material: self.materials.len(),
            ..Mesh::default()
        });
        self.materials.push(Material::emitter("default light", [0.0; 3], [RADIANCE; 3]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;

    #[test]
    fn it_is_above_the_scene_and_faces_down() {
        let mut scene = Scene {
            meshes: vec![Mesh {
                positions: vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
                indices: vec![[0, 1, 2]],
                ..Mesh::default()
            }],
            instances: vec![Instance { mesh: 0, transform: DAffine3::IDENTITY }],
            materials: vec![Material::diffuse("grey", [0.5; 3])],
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
    fn it_does_not_stand_between_a_framed_camera_and_the_scene() {
        for size in [[2.0, 2.0, 2.0], [2.0, 0.0, 2.0], [0.1, 9.0, 0.1], [9.0, 0.1, 0.1]] {
            let far = size.map(|x| x as f32);
            let mesh = Mesh { positions: vec![[0.0; 3], far], ..Mesh::default() };
            let instance = Instance { mesh: 0, transform: DAffine3::IDENTITY };
            let mut scene = Scene { meshes: vec![mesh], instances: vec![instance], ..Scene::default() };
            let bounds = scene.bounds();
            scene.add_default_light();
            let to_light = scene.instances[1].transform.inverse();
            for aspect in [0.1, 1.0, 10.0] {
                let camera = to_light.transform_point3(Camera::framing(bounds, aspect).position);
                for corner in 0..8 {
                    let pick = |axis: usize| if corner >> axis & 1 == 0 { 0.0 } else { size[axis] };
                    let corner = to_light.transform_point3(DVec3::new(pick(0), pick(1), pick(2)));
                    let crossing = camera + (corner - camera) * (camera.y / (camera.y - corner.y));
                    let blocked = camera.y > 0.0 && crossing.x.abs().max(crossing.z.abs()) <= 1.0;
                    assert!(!blocked, "{size:?} {aspect}: {crossing}");
                }
            }
        }
    }

    #[test]
    fn an_empty_scene_gets_one_too() {
        let mut scene = Scene::default();
        scene.add_default_light();
        assert!(scene.has_light() && scene.instances[0].transform.is_finite());
    }
}
