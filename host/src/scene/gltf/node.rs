//! The node hierarchy: instances, lights and the camera.

use std::collections::HashSet;

use glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};
use gltf::json::{Camera as JsonCamera, Index, Node};

use super::{Importer, Problem, exact, label};
use crate::error::ensure;
use crate::scene::{Camera, Instance, MAX_COORDINATE, double};

impl Importer<'_> {
    /// Adds what the nodes of the default scene hold.
    ///
    /// glTF demands that nodes form trees. Reaching a node twice is therefore an error, which also ends cycles.
    pub(super) fn add_nodes(&mut self) -> Result<(), Problem> {
        let root = self.document.root;
        let scene = root.scenes.get(root.scene.map_or(0, |scene| scene.value()));
        self.scene.default_size = scene.and_then(|scene| exact::size(&scene.extras));
        let mut reached = HashSet::new();
        let mut pending: Vec<_> = self.roots()?.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
        while let Some((index, parent)) = pending.pop() {
            let node = self.document.get(index, "it refers to node")?;
            ensure!(reached.insert(index), "node {index} is reached twice; nodes have to form trees");
            let world = parent * transform(node, index)?;
            ensure!(world.is_finite(), "the transform of node {index} is not finite");
            self.add_node(node, index, world)?;
            pending.extend(node.children.iter().flatten().rev().map(|&child| (child, world)));
        }
        Ok(())
    }

    /// The root nodes of the default scene, else of the first, else all nodes that are no one's child.
    fn roots(&self) -> Result<Vec<Index<Node>>, Problem> {
        let root = self.document.root;
        if root.scenes.is_empty() && root.scene.is_none() {
            let children: HashSet<_> = root.nodes.iter().flat_map(|node| node.children.iter().flatten()).collect();
            let nodes = (0..root.nodes.len() as u32).map(Index::new);
            return Ok(nodes.filter(|node| !children.contains(node)).collect());
        }
        let index = root.scene.map_or(0, |scene| scene.value());
        let scene = root.scenes.get(index).ok_or_else(|| format!("its default scene {index} does not exist"))?;
        Ok(scene.nodes.clone())
    }

    fn add_node(&mut self, node: &Node, index: Index<Node>, world: DAffine3) -> Result<(), Problem> {
        if let Some(mesh) = node.mesh {
            let instances = self.primitives(mesh)?.map(|mesh| Instance { mesh, transform: world });
            self.scene.instances.extend(instances);
        }
        let name = label(node.name.as_ref(), "node", index);
        self.warn_if(node.skin.is_some(), format!("{name}: its skin is ignored"));
        if let (Some(camera), None) = (node.camera, self.scene.camera) {
            self.add_camera(camera, world)?;
        }
        self.add_light(node, &world)
    }

    fn add_camera(&mut self, index: Index<JsonCamera>, world: DAffine3) -> Result<(), Problem> {
        let camera = self.document.get(index, "a node has camera")?;
        let name = label(camera.name.as_ref(), "camera", index);
        let Some(perspective) = &camera.perspective else {
            self.warn(format!("{name}: it is not a perspective camera and was ignored"));
            return Ok(());
        };
        let vertical_fov = f64::from(perspective.yfov);
        let possible = vertical_fov > 0.0 && vertical_fov < std::f64::consts::PI;
        ensure!(possible, "{name} has a field of view of {vertical_fov} radians; it has to be between 0 and pi");
        let position = world.translation;
        let near = position.abs().max_element() <= MAX_COORDINATE;
        ensure!(near, "{name} is at {position}, beyond {MAX_COORDINATE:e}; move it nearer to the origin");
        // A camera looks along its -z; its scale has no meaning.
        let forward = world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
        let up = world.transform_vector3(DVec3::Y).normalize_or(DVec3::Y);
        let rounded = Camera::pinhole(position, position + forward, up, vertical_fov);
        let exact = exact::camera(&camera.extras, &world, perspective.yfov);
        self.scene.camera = Some(exact.unwrap_or(rounded));
        Ok(())
    }
}

/// From the node's space to its parent's.
fn transform(node: &Node, index: Index<Node>) -> Result<DAffine3, Problem> {
    if let Some(matrix) = node.matrix {
        let rounded = affine(matrix).ok_or_else(|| format!("the matrix of node {index} is not affine"))?;
        return Ok(exact::node_transform(&node.extras, matrix).unwrap_or(rounded));
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or_default().0.map(f64::from));
    let length = rotation.length();
    ensure!(length > 0.0 && length.is_finite(), "the rotation of node {index} has no direction");
    let [scale, translation] = [node.scale.unwrap_or([1.0; 3]), node.translation.unwrap_or_default()].map(double);
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation.normalize(), translation))
}

/// A column-major matrix whose last row is 0, 0, 0, 1.
fn affine(matrix: [f32; 16]) -> Option<DAffine3> {
    let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
    (matrix.row(3) == DVec4::W).then(|| DAffine3::from_mat4(matrix))
}
