//! The node hierarchy: instances, lights and the camera.

use std::collections::BTreeSet;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use gltf::json::{Camera as JsonCamera, Index, Node};

use super::{Importer, Problem, exact, label};
use crate::scene::{Camera, Instance, MAX_COORDINATE};

impl Importer<'_> {
    /// Adds what the nodes of the default scene hold.
    ///
    /// glTF demands that nodes form trees. Reaching a node twice is therefore an error, which also ends cycles.
    pub(super) fn add_nodes(&mut self) -> Result<(), Problem> {
        let root = self.document.root;
        let scene = root.scenes.get(root.scene.map_or(0, |scene| scene.value()));
        self.scene.default_size = scene.and_then(|scene| exact::size(&scene.extras));
        let mut reached = vec![false; root.nodes.len()];
        let mut pending: Vec<(usize, DAffine3)> =
            self.roots()?.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
        while let Some((index, parent)) = pending.pop() {
            let missing = || format!("it refers to node {index}, which does not exist");
            let node = root.nodes.get(index).ok_or_else(missing)?;
            let seen = reached.get_mut(index).ok_or_else(missing)?;
            if std::mem::replace(seen, true) {
                return Err(format!("node {index} is reached twice; nodes have to form trees"));
            }
            let world = parent * transform(node, index)?;
            if !world.is_finite() {
                return Err(format!("the transform of node {index} is not finite"));
            }
            self.add_node(node, index, world)?;
            pending.extend(node.children.iter().flatten().rev().map(|child| (child.value(), world)));
        }
        Ok(())
    }

    /// The root nodes of the default scene, else of the first, else all nodes that are no one's child.
    fn roots(&self) -> Result<Vec<usize>, Problem> {
        let root = self.document.root;
        let index = root.scene.map_or(0, |scene| scene.value());
        if root.scenes.is_empty() && root.scene.is_none() {
            let children: BTreeSet<usize> =
                root.nodes.iter().flat_map(|node| node.children.iter().flatten()).map(Index::value).collect();
            return Ok((0..root.nodes.len()).filter(|node| !children.contains(node)).collect());
        }
        let scene = root.scenes.get(index).ok_or_else(|| format!("its default scene {index} does not exist"))?;
        Ok(scene.nodes.iter().map(Index::value).collect())
    }

    fn add_node(&mut self, node: &Node, index: usize, world: DAffine3) -> Result<(), Problem> {
        if let Some(mesh) = node.mesh {
            self.add_instances(mesh.value(), world)?;
        }
        if node.skin.is_some() {
            self.warn(format!("{}: its skin is ignored", label(node.name.as_ref(), "node", index)));
        }
        if let (Some(camera), None) = (node.camera, self.scene.camera) {
            self.add_camera(camera, world)?;
        }
        self.add_light(node, &world)
    }

    fn add_instances(&mut self, mesh: usize, transform: DAffine3) -> Result<(), Problem> {
        let instances = self.primitives(mesh)?.map(|mesh| Instance { mesh, transform });
        self.scene.instances.extend(instances);
        Ok(())
    }

    fn add_camera(&mut self, index: Index<JsonCamera>, world: DAffine3) -> Result<(), Problem> {
        let index = index.value();
        let missing = || format!("a node has camera {index}, which does not exist");
        let camera = self.document.root.cameras.get(index).ok_or_else(missing)?;
        let name = label(camera.name.as_ref(), "camera", index);
        let Some(perspective) = &camera.perspective else {
            self.warn(format!("{name}: it is not a perspective camera and was ignored"));
            return Ok(());
        };
        let vertical_fov = f64::from(perspective.yfov);
        if !(vertical_fov > 0.0 && vertical_fov < std::f64::consts::PI) {
            return Err(format!("{name} has a field of view of {vertical_fov} radians; it has to be between 0 and pi"));
        }
        let position = world.translation;
        if position.abs().max_element() > MAX_COORDINATE {
            return Err(format!("{name} is at {position}, beyond {MAX_COORDINATE:e}; move it nearer to the origin"));
        }
        if let Some(camera) = exact::camera(&camera.extras, &world, perspective.yfov) {
            self.scene.camera = Some(camera);
            return Ok(());
        }
        // A camera looks along its -z; its scale has no meaning.
        let forward = world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
        let up = world.transform_vector3(DVec3::Y).normalize_or(DVec3::Y);
        self.scene.camera = Some(Camera::pinhole(position, position + forward, up, vertical_fov));
        Ok(())
    }
}

/// From the node's space to its parent's.
fn transform(node: &Node, index: usize) -> Result<DAffine3, Problem> {
    if let Some(matrix) = node.matrix {
        let rounded = affine(matrix).ok_or_else(|| format!("the matrix of node {index} is not affine"))?;
        return Ok(exact::node_transform(&node.extras, matrix).unwrap_or(rounded));
    }
    let [x, y, z, w] = node.rotation.unwrap_or_default().0.map(f64::from);
    let rotation = DQuat::from_xyzw(x, y, z, w);
    let length = rotation.length();
    if !(length > 0.0 && length.is_finite()) {
        return Err(format!("the rotation of node {index} has no direction"));
    }
    Ok(DAffine3::from_scale_rotation_translation(
        vector(node.scale.unwrap_or([1.0; 3])),
        rotation.normalize(),
        vector(node.translation.unwrap_or_default()),
    ))
}

/// A column-major matrix whose last row is 0, 0, 0, 1.
fn affine(matrix: [f32; 16]) -> Option<DAffine3> {
    let [x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3, t0, t1, t2, t3] = matrix;
    let linear = DMat3::from_cols(vector([x0, x1, x2]), vector([y0, y1, y2]), vector([z0, z1, z2]));
    ([x3, y3, z3, t3] == [0.0, 0.0, 0.0, 1.0]).then(|| DAffine3::from_mat3_translation(linear, vector([t0, t1, t2])))
}

fn vector(components: [f32; 3]) -> DVec3 {
    DVec3::from_array(components.map(f64::from))
}
