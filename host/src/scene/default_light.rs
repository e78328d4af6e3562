//! A light for scenes that have none.

use glam::{DAffine3, DVec3};

use super::{Material, Mesh, Scene, camera::centre_and_half_size};

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
    /// [`super::Camera::framing`] before sees nothing of it; a scene that has no camera yet is framed with the light, so set
    /// [`Scene::camera`] first. It reflects nothing.
    pub fn add_default_light(&mut self) {
        let bounds = self.bounds();
        let (centre, half) = centre_and_half_size(bounds);
        let radius = half.length();
        let position = centre + DVec3::new(0.0, half.y + HEIGHT * radius, TO_THE_FRONT * radius);
        let transform = DAffine3::from_translation(position) * DAffine3::from_scale(DVec3::splat(HALF_SIDE * radius));
        let material = self.add_material(Material::emitter("default light", [0.0; 3], [RADIANCE; 3]));
        let square = Mesh::quad(DVec3::new(-1.0, 0.0, -1.0), [DVec3::X * 2.0, DVec3::Z * 2.0]);
        self.place_mesh("default light", material, square, transform);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;

    #[test]
    fn it_is_above_the_scene_and_faces_down() {
        let mut scene = Scene::default();
        let grey = scene.add_material(Material::diffuse("grey", [0.5; 3]));
        scene.add_mesh("square", grey, Mesh::quad(DVec3::ZERO, [DVec3::X * 2.0, DVec3::Y * 2.0]));
        assert!(!scene.has_light());
        scene.add_default_light();
        assert!(scene.has_light());
        for [a, b, c] in scene.meshes[1].triangles() {
            let [a, b, c] = [a, b, c].map(|corner| scene.instances[1].transform.transform_point3(corner));
            assert!(a.y > 2.0 && (b - a).cross(c - a).y < 0.0);
        }
    }

    #[test]
    fn it_does_not_stand_between_a_framed_camera_and_the_scene() {
        for size in [[2.0, 2.0, 2.0], [2.0, 0.0, 2.0], [0.1, 9.0, 0.1], [9.0, 0.1, 0.1]] {
            let mut scene = Scene::default();
            scene.add_mesh("box", 0, Mesh::cuboid(DVec3::ZERO, size.into()));
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
