//! The node hierarchy: instances, lights and the camera.

use std::collections::HashSet;

use glam::{DAffine3, DMat4, DVec3, DVec4};
use gltf::json::{Camera as JsonCamera, Index, Node};

use restir_shared::num;

use super::deform::Deformer;
use super::{Importer, Problem, exact, label};
use crate::error::ensure;
use crate::scene::{Camera, Instance, MAX_COORDINATE, Part, Placement, Property};

/// The longer side of a picture whose aspect alone is known, in pixels.
const USUAL_SIDE: f32 = 512.0;

/// A node on the way down.
struct Reached {
    index: Index<Node>,
    parent: Option<usize>,
    /// From the parent's space to the world's.
    world: DAffine3,
    /// The same in the precision of the file.
    exact: DAffine3,
    /// Whether a node that it is within moves.
    moves: bool,
}

impl Importer<'_> {
    /// Adds what the nodes of the default scene hold.
    ///
    /// glTF demands that nodes form trees. Reaching a node twice is therefore an error, which also ends cycles.
    pub(super) fn add_nodes(&mut self) -> Result<(), Problem> {
        let root = self.document.root;
        let scene = root.scenes.get(root.scene.map_or(0, |scene| scene.value()));
        self.scene.default_size = scene.and_then(|scene| exact::size(&scene.extras));
        let mut reached = HashSet::new();
        let moved: HashSet<usize> =
            self.tracks.iter().filter(|t| t.property != Property::Weights).map(|t| t.node).collect();
        let (world, exact) = (DAffine3::IDENTITY, DAffine3::IDENTITY);
        let root = |index| Reached { index, parent: None, world, exact, moves: false };
        let mut pending: Vec<Reached> = self.roots()?.into_iter().rev().map(root).collect();
        while let Some(Reached { index, parent, world, exact, moves }) = pending.pop() {
            let node = self.document.get(index, "it refers to node")?;
            ensure!(reached.insert(index), "node {index} is reached twice; nodes have to form trees");
            let world = world * placement(node, index)?.at_rest();
            let exact = exact * self.exact_placement(node, index)?.at_rest();
            ensure!(world.is_finite(), "the transform of node {index} is not finite");
            let moves = moves || moved.contains(&index.value());
            self.movers.nodes.push((index.value(), parent));
            self.add_node(node, index, [world, exact], moves)?;
            let child =
                |&child: &Index<Node>| Reached { index: child, parent: Some(index.value()), world, exact, moves };
            pending.extend(node.children.iter().flatten().rev().map(child));
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

    fn add_node(
        &mut self,
        node: &Node,
        index: Index<Node>,
        [world, exact]: [DAffine3; 2],
        moves: bool,
    ) -> Result<(), Problem> {
        let first = self.scene.instances.len();
        let mut deforms = false;
        if let Some(mesh) = node.mesh {
            let deformer = Deformer::of(index, node, self.document.get(mesh, "a node has mesh")?);
            deforms = deformer.is_some();
            let meshes = if deforms { self.add_mesh(mesh, deformer)? } else { self.primitives(mesh)? };
            // joints alone place what hangs on them
            let transform = if node.skin.is_some() { DAffine3::IDENTITY } else { world };
            self.scene.instances.extend(meshes.map(|mesh| Instance::new(mesh, transform)));
            let added = &mut self.scene.instances[first..];
            let group = exact::node_group(&node.extras)
                .map(|group| (self.document.root.nodes.len() as u32).wrapping_add(group));
            let group = group.or((added.len() > 1).then_some(index.value() as u32));
            added.iter_mut().for_each(|instance| instance.group = group);
        }
        let instances = first..self.scene.instances.len();
        let instances = instances.filter(|_| node.skin.is_none()).map(Part::Instance);
        self.places.extend(instances.clone().map(|part| (part, exact)));
        let mut parts: Vec<Part> = instances.filter(|_| moves || deforms).collect();
        let (lights, had_camera) = (self.scene.lights.len(), self.scene.camera.is_some());
        if let (Some(camera), false) = (node.camera, had_camera) {
            self.add_camera(camera, [world, exact])?;
            parts.extend((moves && self.scene.camera.is_some()).then_some(Part::Camera));
        }
        self.add_light(node, &world)?;
        let lights = (lights..self.scene.lights.len()).map(Part::Light);
        self.places.extend(lights.clone().map(|part| (part, exact)));
        parts.extend(lights.filter(|_| moves));
        self.movers.attachments.extend(parts.into_iter().map(|part| (index.value(), part)));
        Ok(())
    }

    fn add_camera(&mut self, index: Index<JsonCamera>, [world, place]: [DAffine3; 2]) -> Result<(), Problem> {
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
        let rounded = Camera::pinhole(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, vertical_fov).carried(&world);
        let exact = exact::camera(&camera.extras, &world, perspective.yfov);
        let aspect = perspective.aspect_ratio.filter(|aspect| aspect.is_finite() && *aspect > 0.0);
        self.scene.default_size = self.scene.default_size.or(aspect.map(size_of));
        if exact.is_none() {
            self.places.push((Part::Camera, place));
        }
        self.scene.camera = Some(exact.unwrap_or(rounded));
        Ok(())
    }

    /// As [`placement`], in the precision of the file.
    pub(super) fn exact_placement(&self, node: &Node, index: Index<Node>) -> Result<Placement, Problem> {
        let digits = self.document.digits.get(index.value()).copied().unwrap_or_default();
        Ok(match placement(node, index)? {
            Placement::Matrix(rounded) => {
                let own = node.matrix.and_then(|matrix| exact::node_transform(&node.extras, matrix));
                Placement::Matrix(own.or(digits.matrix.map(columns)).unwrap_or(rounded))
            }
            Placement::Parts { translation, rotation, scale } => Placement::Parts {
                translation: digits.translation.unwrap_or(translation),
                rotation: digits.rotation.unwrap_or(rotation),
                scale: digits.scale.unwrap_or(scale),
            },
        })
    }
}

/// A picture of this aspect, whose longer side is the usual one.
fn size_of(aspect: f32) -> [u32; 2] {
    let shorter = |part: f32| (num::nearest(USUAL_SIDE * part) as u32).max(1);
    let longer = USUAL_SIDE as u32;
    if aspect > 1.0 { [longer, shorter(num::recip(aspect))] } else { [shorter(aspect), longer] }
}

/// From the node's space to its parent's, in single precision.
pub(super) fn placement(node: &Node, index: Index<Node>) -> Result<Placement, Problem> {
    if let Some(matrix) = node.matrix {
        let rounded = affine(matrix).ok_or_else(|| format!("the matrix of node {index} is not affine"))?;
        return Ok(Placement::Matrix(exact::node_transform(&node.extras, matrix).unwrap_or(rounded)));
    }
    let rotation = node.rotation.unwrap_or_default().0;
    let turned = rotation != [0.0; 4] && rotation.iter().all(|x| x.is_finite());
    ensure!(turned, "the rotation of node {index} has no direction");
    Ok(Placement::Parts {
        translation: node.translation.unwrap_or_default().map(f64::from),
        rotation: rotation.map(f64::from),
        scale: node.scale.unwrap_or([1.0; 3]).map(f64::from),
    })
}

/// A column-major matrix without its last row.
fn columns(matrix: [f64; 16]) -> DAffine3 {
    let [x, y, z, w] = DMat4::from_cols_array(&matrix).to_cols_array_2d().map(|[x, y, z, _]| DVec3::new(x, y, z));
    DAffine3::from_cols(x, y, z, w)
}

/// A column-major matrix whose last row is 0, 0, 0, 1.
fn affine(matrix: [f32; 16]) -> Option<DAffine3> {
    let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
    (matrix.row(3) == DVec4::W).then(|| DAffine3::from_mat4(matrix))
}
