//! What is wrong with a rig, with a place and a way out.

use std::collections::BTreeSet;

use super::{Deformation, Influences, Part, Placement, Rig, Skinning, Track};
use crate::error::ensure;
use crate::scene::{Mesh, Scene};

/// What is wrong, as a sentence without a full stop.
type Problem = String;

impl Rig {
    /// Whether [`Self::pose`] can pose the scene.
    pub(in crate::scene) fn check(&self, scene: &Scene) -> Result<(), Problem> {
        (0..self.nodes.len()).try_for_each(|node| self.check_node(node))?;
        self.check_attachments(scene)?;
        for skin in &self.skins {
            let (joints, matrices) = (skin.joints.len(), skin.inverse_bind.len());
            let complete = matrices == 0 || matrices == joints;
            ensure!(
                complete,
                "skin {:?} has {joints} joints and {matrices} inverse bind matrices; give each one",
                skin.name
            );
            skin.joints.iter().try_for_each(|&joint| self.node_name(joint).map(drop))?;
            let finite = skin.inverse_bind.as_flattened().as_flattened().iter().all(|x| x.is_finite());
            ensure!(finite, "an inverse bind matrix of skin {:?} is not finite; correct it", skin.name);
        }
        let mut meshes = BTreeSet::new();
        for deformation in &self.deformations {
            let index = deformation.mesh;
            let mesh = scene.meshes.get(index).ok_or_else(|| format!("mesh {index} deforms, but does not exist"))?;
            ensure!(meshes.insert(index), "mesh {:?} deforms in two ways; keep one", mesh.name);
            self.check_deformation(deformation, mesh).map_err(|problem| format!("mesh {:?}: {problem}", mesh.name))?;
        }
        let mut changed = BTreeSet::new();
        for track in &self.tracks {
            let subject = format!("the {} of node {}", track.property.name(), self.node_name(track.node)?);
            ensure!(changed.insert((track.node, track.property)), "{subject} has two tracks; keep one");
            self.check_track(track).map_err(|problem| format!("{subject}: {problem}"))?;
        }
        Ok(())
    }

    /// The name of a node, or its index if it has none.
    fn node_name(&self, node: usize) -> Result<String, Problem> {
        let found = self.nodes.get(node).ok_or_else(|| format!("it refers to node {node}, which does not exist"))?;
        Ok(if found.name.is_empty() { node.to_string() } else { format!("{:?}", found.name) })
    }

    fn check_node(&self, index: usize) -> Result<(), Problem> {
        let (node, name) = (&self.nodes[index], self.node_name(index)?);
        ensure!(node.parent.is_none_or(|parent| parent < index), "node {name} comes before its parent; put it after");
        let (finite, turned) = match node.placement {
            Placement::Matrix(matrix) => (matrix.is_finite(), true),
            Placement::Parts { translation, rotation, scale } => (
                [&translation[..], &rotation, &scale].into_iter().flatten().all(|x| x.is_finite()),
                rotation != [0.0; 4],
            ),
        };
        ensure!(finite && node.weights.iter().all(|x| x.is_finite()), "node {name} has a number that is not finite");
        ensure!(turned, "the rotation of node {name} has no direction; give it a length");
        Ok(())
    }

    fn check_track(&self, track: &Track) -> Result<(), Problem> {
        let node = &self.nodes[track.node];
        let parts = matches!(node.placement, Placement::Parts { .. }) || track.property == super::Property::Weights;
        ensure!(parts, "it changes, but the node has a matrix; give it translation, rotation and scale");
        let (keys, values) = (track.times.len(), track.values.len());
        let ascending = track.times.is_sorted() && track.times.iter().all(|time| time.is_finite());
        ensure!(keys > 0 && ascending, "its keys have no ascending times; sort them");
        let width = track.property.width(node.weights.len()) * track.interpolation.values_per_key();
        ensure!(
            values == keys * width,
            "its {keys} keys need {} numbers and have {values}; export them again",
            keys * width
        );
        ensure!(track.values.iter().all(|x| x.is_finite()), "a value is not finite; correct it");
        Ok(())
    }

    fn check_attachments(&self, scene: &Scene) -> Result<(), Problem> {
        let mut carried = BTreeSet::new();
        for attachment in &self.attachments {
            let name = self.node_name(attachment.node)?;
            let exists = match attachment.part {
                Part::Instance(index) => index < scene.instances.len(),
                Part::Light(index) => index < scene.lights.len(),
                Part::Camera => scene.camera.is_some(),
            };
            let part = attachment.part;
            ensure!(exists, "node {name} carries {part:?}, which does not exist");
            ensure!(carried.insert(part), "node {name} carries {part:?}, which another node carries; keep one");
        }
        Ok(())
    }

    fn check_deformation(&self, deformation: &Deformation, mesh: &Mesh) -> Result<(), Problem> {
        let node = self.node_name(deformation.node)?;
        let (weights, targets) = (self.nodes[deformation.node].weights.len(), deformation.targets.len());
        ensure!(weights == targets, "it has {targets} morph targets, and node {node} {weights} weights; give each one");
        let vertices = mesh.positions.len();
        for (number, target) in deformation.targets.iter().enumerate() {
            for (what, deltas) in
                [("positions", &target.positions), ("normals", &target.normals), ("tangents", &target.tangents)]
            {
                let count = deltas.len();
                let fits = count == 0 || count == vertices;
                ensure!(
                    fits,
                    "it has {vertices} vertices, and morph target {number} {what} for {count}; export it again"
                );
                let finite = deltas.as_flattened().iter().all(|x| x.is_finite());
                ensure!(finite, "morph target {number} has {what} that are not finite; correct them");
            }
        }
        deformation.skinning.as_ref().map_or(Ok(()), |skinning| self.check_skinning(skinning, vertices))
    }

    fn check_skinning(&self, skinning: &Skinning, vertices: usize) -> Result<(), Problem> {
        let index = skinning.skin;
        let skin = self.skins.get(index).ok_or_else(|| format!("it has skin {index}, which does not exist"))?;
        for (number, Influences { joints, weights }) in skinning.sets.iter().enumerate() {
            for (what, count) in [("joints", joints.len()), ("weights", weights.len())] {
                ensure!(
                    count == vertices,
                    "it has {vertices} vertices, and {what} of set {number} for {count}; export it again"
                );
            }
        }
        (0..vertices).try_for_each(|vertex| {
            check_vertex(skinning, vertex, skin.joints.len())
                .map_err(|problem| format!("vertex {vertex} {problem}; correct its skin {:?}", skin.name))
        })
    }
}

fn check_vertex(skinning: &Skinning, vertex: usize, joints: usize) -> Result<(), Problem> {
    let mut sum = 0.0;
    for set in &skinning.sets {
        for (joint, weight) in set.joints[vertex].into_iter().zip(set.weights[vertex]) {
            ensure!(weight.is_finite() && weight >= 0.0, "has a weight of {weight}, which is no share");
            ensure!(
                weight == 0.0 || usize::from(joint) < joints,
                "hangs on joint {joint}, of which there are {joints}"
            );
            sum += f64::from(weight);
        }
    }
    let hangs = sum > 0.0;
    ensure!(hangs, "hangs on no joint: its weights are all 0");
    Ok(())
}
