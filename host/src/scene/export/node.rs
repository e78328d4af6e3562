//! Nodes: instances, lights and the camera.

use glam::{DAffine3, DMat3, DVec3};
use serde_json::{Value, json};

use super::material::power_of_two_above;
use super::{Document, Problem};
use crate::scene::gltf::exact;
use crate::scene::{Camera, Light, LightKind, Scene};

/// What is nearer to a camera is not seen by renderers that need to know.
const NEAR: f32 = 0.01;

impl Document {
    /// Adds a node for each instance, light and the camera; `meshes` maps the scene's meshes to the file's.
    pub(super) fn add_nodes(&mut self, scene: &Scene, meshes: &[Option<usize>]) -> Result<(), Problem> {
        for (number, instance) in scene.instances.iter().enumerate() {
            let mesh = meshes
                .get(instance.mesh)
                .ok_or_else(|| format!("instance {number} refers to mesh {}, which does not exist", instance.mesh))?;
            if let Some(mesh) = mesh {
                let node = json!({ "mesh": mesh, "name": scene.meshes[instance.mesh].name });
                self.add_node(node, &instance.transform)?;
            }
        }
        scene.lights.iter().try_for_each(|light| self.add_light(light))?;
        scene.camera.iter().try_for_each(|camera| self.add_camera(camera, scene.default_size))
    }

    fn add_node(&mut self, mut node: Value, transform: &DAffine3) -> Result<(), Problem> {
        let matrix = exact::matrix(transform);
        if !matrix.iter().all(|entry| entry.is_finite()) {
            return Err(format!("the transform of {} is not finite", node["name"]));
        }
        if *transform != DAffine3::IDENTITY {
            node["matrix"] = json!(matrix);
        }
        if let Some(extras) = exact::node_extras(transform) {
            node["extras"] = extras;
        }
        self.nodes.push(node);
        Ok(())
    }

    fn add_light(&mut self, light: &Light) -> Result<(), Problem> {
        if !light.intensity.iter().all(|channel| channel.is_finite() && *channel >= 0.0) {
            return Err(format!("light {:?} has an intensity of {:?}", light.name, light.intensity));
        }
        let power = power_of_two_above(light.intensity);
        let mut converted = json!({
            "name": light.name, "color": light.intensity.map(|channel| channel / power), "intensity": power,
        });
        let (kind, transform) = match light.kind {
            LightKind::Point { position } => ("point", DAffine3::from_translation(position)),
            LightKind::Directional { direction } => ("directional", shining(DVec3::ZERO, direction)),
            LightKind::Spot { position, direction, inner, outer } => {
                let [inner_single, outer_single] = [inner, outer].map(|angle| angle as f32);
                converted["spot"] = json!({ "innerConeAngle": inner_single, "outerConeAngle": outer_single });
                converted["extras"] = exact::cone_extras([inner, outer]);
                ("spot", shining(position, direction))
            }
        };
        converted["type"] = json!(kind);
        self.lights.push(converted);
        let extension = self.extension("KHR_lights_punctual");
        let reference = json!({ extension: { "light": self.lights.len() - 1 } });
        self.add_node(json!({ "name": light.name, "extensions": reference }), &transform)
    }

    fn add_camera(&mut self, camera: &Camera, size: Option<[u32; 2]>) -> Result<(), Problem> {
        camera.check()?;
        let mut perspective = json!({ "yfov": camera.vertical_fov as f32, "znear": NEAR });
        if let Some([width, height]) = size.filter(|[width, height]| *width > 0 && *height > 0) {
            perspective["aspectRatio"] = json!(f64::from(width) / f64::from(height));
        }
        self.cameras.push(json!({
            "type": "perspective", "perspective": perspective, "extras": exact::camera_extras(camera),
        }));
        // In single precision: the extras of the camera have the rest.
        let matrix = exact::matrix(&exact::camera_transform(camera));
        self.nodes.push(json!({ "name": "camera", "camera": self.cameras.len() - 1, "matrix": matrix }));
        Ok(())
    }
}

/// The transform of a light whose -z is `direction`.
fn shining(position: DVec3, direction: DVec3) -> DAffine3 {
    let z = -direction;
    let (x, y) = z.normalize_or(DVec3::Z).any_orthonormal_pair();
    DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), position)
}
