//! Nodes: instances, lights and the camera.

use std::collections::BTreeSet;

use glam::{DAffine3, DMat3, DVec3};
use serde_json::{Value, json};

use super::material::power_of_two_above;
use super::rig::{carrier, check_skins, motion_of};
use super::{Document, Problem};
use crate::error::ensure;
use crate::scene::gltf::exact;
use crate::scene::{Camera, Instance, Light, LightKind, Part, Scene};

/// What is nearer to a camera is not seen by renderers that need to know.
const NEAR: f32 = 0.01;

impl Document {
    /// Adds a node for each instance, light and the camera; `meshes` maps the scene's meshes to the file's.
    pub(super) fn add_nodes(&mut self, scene: &Scene, meshes: &[Option<usize>]) -> Result<(), Problem> {
        let rig = &scene.animation.rig;
        check_skins(rig)?;
        self.add_rig(rig)?;
        let deforming: BTreeSet<usize> = rig.deformations.iter().map(|deformation| deformation.mesh).collect();
        let mut instances: Vec<(usize, usize)> =
            scene.instances.iter().map(|instance| instance.mesh).enumerate().collect();
        // what deforms has to lie in its node, what else that carries may lie in one within
        instances.sort_by_key(|&(_, mesh)| !deforming.contains(&mesh));
        for (number, index) in instances {
            ensure!(index < meshes.len(), "instance {number} refers to mesh {index}, which does not exist");
            if let Some(mesh) = meshes[index] {
                self.add_instance(scene, number, mesh)?;
            }
        }
        for (index, light) in scene.lights.iter().enumerate() {
            self.add_light(light, carrier(rig, Part::Light(index)))?;
        }
        let node = carrier(rig, Part::Camera);
        scene.camera.iter().try_for_each(|camera| self.add_camera(camera, scene.default_size, node))
    }

    /// Adds an instance, whose mesh is `mesh` of the file.
    fn add_instance(&mut self, scene: &Scene, number: usize, mesh: usize) -> Result<(), Problem> {
        let (Instance { mesh: own, transform, group }, rig) = (scene.instances[number], &scene.animation.rig);
        let node = json!({ "mesh": mesh, "name": scene.meshes[own].name });
        if let Some(deformation) = rig.deformations.iter().find(|deformation| deformation.mesh == own) {
            return self.carry_deformed(scene, number, deformation, mesh);
        }
        let node = if let Some(carrier) = carrier(rig, Part::Instance(number)) {
            self.carry(carrier, "mesh", json!(mesh))?
        } else if let Some(motion) = motion_of(scene, number) {
            self.add_motion(motion, node, &transform)?
        } else {
            self.add_node(node, &transform)?
        };
        if let (Some(group), Some(nodes)) = (group, self.arrays.get_mut("nodes")) {
            nodes[node]["extras"]["restir"]["group"] = json!(group);
        }
        Ok(())
    }

    /// Adds a node and gives its index.
    pub(super) fn add_node(&mut self, mut node: Value, transform: &DAffine3) -> Result<usize, Problem> {
        let matrix = exact::matrix(transform);
        let finite = matrix.iter().all(|entry| entry.is_finite());
        ensure!(finite, "the transform of {} is not finite", node["name"]);
        if *transform != DAffine3::IDENTITY {
            node["matrix"] = json!(matrix);
        }
        if let Some(extras) = exact::node_extras(transform) {
            node["extras"] = extras;
        }
        Ok(self.add("nodes", node))
    }

    fn add_light(&mut self, Light { name, intensity, kind }: &Light, carrier: Option<usize>) -> Result<(), Problem> {
        let possible = intensity.iter().all(|channel| channel.is_finite() && *channel >= 0.0);
        ensure!(possible, "light {name:?} has an intensity of {intensity:?}");
        let power = power_of_two_above(*intensity);
        let color = intensity.map(|channel| channel / power);
        let mut light = json!({ "name": name, "color": color, "intensity": power });
        let (kind, transform) = match *kind {
            LightKind::Point { position } => ("point", DAffine3::from_translation(position)),
            LightKind::Directional { direction } => ("directional", shining(DVec3::ZERO, direction)),
            LightKind::Spot { position, direction, inner, outer } => {
                let [inner_single, outer_single] = [inner, outer].map(|angle| angle as f32);
                light["spot"] = json!({ "innerConeAngle": inner_single, "outerConeAngle": outer_single });
                light["extras"] = exact::cone_extras([inner, outer]);
                ("spot", shining(position, direction))
            }
        };
        light["type"] = json!(kind);
        let reference = json!({ self.extension("KHR_lights_punctual"): { "light": self.add("lights", light) } });
        match carrier {
            Some(node) => self.carry(node, "extensions", reference).map(drop),
            None => self.add_node(json!({ "name": name, "extensions": reference }), &transform).map(drop),
        }
    }

    fn add_camera(&mut self, camera: &Camera, size: Option<[u32; 2]>, carrier: Option<usize>) -> Result<(), Problem> {
        camera.check()?;
        let mut perspective = json!({ "yfov": camera.vertical_fov as f32, "znear": NEAR });
        if let Some([width, height]) = size.filter(|[width, height]| *width > 0 && *height > 0) {
            perspective["aspectRatio"] = json!(f64::from(width) / f64::from(height));
        }
        let extras = exact::camera_extras(camera);
        let index = self.add("cameras", json!({ "type": "perspective", "perspective": perspective, "extras": extras }));
        if let Some(node) = carrier {
            return self.carry(node, "camera", json!(index)).map(drop);
        }
        // In single precision: the extras of the camera have the rest.
        let matrix = exact::matrix(&camera.node_transform());
        self.add("nodes", json!({ "name": "camera", "camera": index, "matrix": matrix }));
        Ok(())
    }
}

/// The transform of a light whose -z is `direction`.
fn shining(position: DVec3, direction: DVec3) -> DAffine3 {
    let z = -direction;
    let (x, y) = z.normalize_or(DVec3::Z).any_orthonormal_pair();
    DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), position)
}
