//! Many small lights around a scene, to measure techniques with.

use glam::{DAffine3, DVec3};
use std::f64::consts::TAU;

use super::builtin::Random;
use super::camera::centre_and_half_size;
use super::{Camera, Material, Mesh, Scene};

/// Distance from the middle of the scene, in radii of its bounds: the nearest and the farthest.
const DISTANCE: [f64; 2] = [1.15, 2.0];
/// None is within this angle of the direction from the middle to the camera, whose cosine it is.
const CLEAR_COS: f64 = 0.8;
/// All triangles together cover this part of the sphere around the scene, whatever their number.
const COVERED: f64 = 0.02;
/// A step of radiance is twice as bright and half as frequent.
const STEPS: usize = 6;
/// Radiance of the faintest: a white sphere in the middle would have a radiance of about a half.
const FAINTEST: f32 = 8.0;
const HUES: [[f32; 3]; 4] = [[1.0, 0.55, 0.3], [1.0, 0.9, 0.75], [0.5, 0.7, 1.0], [0.6, 1.0, 0.6]];

impl Scene {
    /// Adds `count` emissive triangles around the scene's bounds, which face its middle, in four hues and powers that
    /// follow a power law; always the same ones. They reflect nothing, and none is before the camera.
    pub fn add_emitters(&mut self, count: u32, camera: &Camera) {
        let (centre, half) = centre_and_half_size(self.bounds());
        let radius = half.length();
        let to_camera = (camera.position - centre).normalize_or_zero();
        let side = (4.0 * TAU * COVERED / f64::from(count.max(1))).sqrt();
        let mut random = Random::new(u64::from(count));
        let first = self.materials.len();
        for step in 0..STEPS {
            let radiance = |hue: [f32; 3]| hue.map(|channel| channel * FAINTEST * (1 << step) as f32);
            self.materials.extend(HUES.map(|hue| Material::emitter("emitter", [0.0; 3], radiance(hue))));
        }
        let mut meshes = vec![Mesh::default(); self.materials.len() - first];
        for _ in 0..count {
            let direction = direction(&mut random, to_camera);
            let distance = random.range(DISTANCE[0], DISTANCE[1]);
            let step = (random.power_law(1.0, f64::from(1_u32 << STEPS)).log2() as usize).min(STEPS - 1);
            let mesh = &mut meshes[step * HUES.len() + random.below(HUES.len())];
            add_triangle(mesh, direction * distance, side * distance, random.range(0.0, TAU));
        }
        let transform = DAffine3::from_translation(centre) * DAffine3::from_scale(DVec3::splat(radius));
        for (index, mesh) in meshes.into_iter().enumerate().filter(|(_, mesh)| !mesh.indices.is_empty()) {
            self.place_mesh("emitters", first + index, mesh, transform);
        }
    }
}

/// A direction that is not the camera's.
fn direction(random: &mut Random, to_camera: DVec3) -> DVec3 {
    loop {
        let direction = random.direction();
        if direction.dot(to_camera) < CLEAR_COS {
            return direction;
        }
    }
}

/// A triangle around `middle`, turned by an angle, that faces the origin.
fn add_triangle(mesh: &mut Mesh, middle: DVec3, side: f64, turn: f64) {
    let normal = -middle.normalize();
    let across = normal.any_orthonormal_vector();
    let along = normal.cross(across);
    let next = mesh.positions.len() as u32;
    for corner in 0..3 {
        let (sin, cos) = (turn + TAU / 3.0 * f64::from(corner)).sin_cos();
        let position = middle + (across * cos + along * sin) * (side / 3.0_f64.sqrt());
        mesh.positions.push(position.as_vec3().to_array());
    }
    mesh.indices.push([next, next + 1, next + 2]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::buffers::SceneBuffers;
    use crate::scene::builtin;

    #[test]
    fn they_light_the_scene_from_around() {
        let mut scene = builtin::scene("statue").expect("built in");
        scene.meshes.truncate(1);
        scene.instances.retain(|instance| instance.mesh == 0);
        let camera = Camera::framing(scene.bounds(), 1.0);
        let (before, bounds) = (SceneBuffers::build(&scene).expect("builds").stats().triangles, scene.bounds());
        scene.add_emitters(1000, &camera);
        let buffers = SceneBuffers::build(&scene).expect("builds");
        assert_eq!(buffers.stats().triangles, before + 1000);
        let (centre, half) = centre_and_half_size(bounds);
        let to_camera = (camera.position - centre).normalize();
        for instance in &scene.instances[1..] {
            for corners in scene.meshes[instance.mesh].triangles() {
                let [a, b, c] = corners.map(|corner| instance.transform.transform_point3(corner) - centre);
                assert!((b - a).cross(c - a).dot(a) < 0.0, "it faces the middle");
                assert!(a.length() > half.length() && a.normalize().dot(to_camera) < CLEAR_COS + 0.05);
            }
        }
    }
}
