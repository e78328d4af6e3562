//! What moves: the nodes of a rig, skins, and tracks.

use std::collections::BTreeSet;

use glam::DAffine3;
use serde_json::{Value, json};

use super::{Document, Problem};
use crate::error::ensure;
use crate::scene::gltf::exact;
use crate::scene::{
    Attachment, Deformation, Interpolation, Motion, Node, Part, Placement, Property, Rig, Scene, Track,
};

/// What of a scene's motion a file does not say, a sentence each.
pub fn left_out(scene: &Scene) -> Vec<String> {
    let animation = &scene.animation;
    let composed = animation.motions.iter().filter(|motion| is_composed(scene, motion)).count();
    let parts = [
        (
            !animation.blackouts.is_empty(),
            "emitters that go out shine all the time in the file: glTF has no name for it",
        ),
        (
            composed > 0,
            "motions of instances that a node carries or that deform are not written: glTF has one or the other",
        ),
        (composed < animation.motions.len(), "motions of instances are written in single precision"),
        (
            animation.period.is_some(),
            "other programs play the animation once, restir finds its period in the file's extras",
        ),
        (animation.start != 0.0, "other programs begin at time 0, restir finds the start in the file's extras"),
    ];
    parts.iter().filter(|(present, _)| *present).map(|(_, text)| (*text).to_owned()).collect()
}

/// Whether something else moves the instance of a motion.
fn is_composed(scene: &Scene, motion: &Motion) -> bool {
    let Rig { attachments, deformations, .. } = &scene.animation.rig;
    let mesh = scene.instances.get(motion.instance).map(|instance| instance.mesh);
    attachments.iter().any(|attachment| attachment.part == Part::Instance(motion.instance))
        || deformations.iter().any(|deformation| Some(deformation.mesh) == mesh)
}

/// The motion that places an instance alone.
pub(super) fn motion_of(scene: &Scene, instance: usize) -> Option<&Motion> {
    let motion = scene.animation.motions.iter().find(|motion| motion.instance == instance);
    motion.filter(|motion| !is_composed(scene, motion))
}

impl Document {
    /// Adds the nodes of the rig, as the file's first, its skins, and its tracks.
    pub(super) fn add_rig(&mut self, rig: &Rig) -> Result<(), Problem> {
        for (index, node) in rig.nodes.iter().enumerate() {
            let mut json = json!({});
            if !node.name.is_empty() {
                json["name"] = json!(node.name);
            }
            match node.placement {
                Placement::Matrix(matrix) => self.add_node(json, &matrix)?,
                Placement::Parts { translation, rotation, scale } => {
                    json["translation"] = json!(translation);
                    json["rotation"] = json!(rotation);
                    json["scale"] = json!(scale);
                    self.add("nodes", json)
                }
            };
            if let Some(parent) = node.parent {
                self.add_child(parent, index);
            }
        }
        for skin in &rig.skins {
            let mut json = json!({ "name": skin.name, "joints": skin.joints });
            if !skin.inverse_bind.is_empty() {
                let matrices: Vec<f32> = skin.inverse_bind.iter().flat_map(matrix).collect();
                json["inverseBindMatrices"] = self.add_floats(&matrices, "MAT4").into();
            }
            self.add("skins", json);
        }
        rig.tracks.iter().for_each(|track| self.add_track(track));
        Ok(())
    }

    /// Puts a node of the file into another one.
    pub(super) fn add_child(&mut self, parent: usize, child: usize) {
        let Some(parent) = self.arrays.get_mut("nodes").and_then(|nodes| nodes.get_mut(parent)) else { return };
        match parent.get_mut("children").and_then(Value::as_array_mut) {
            Some(children) => children.push(child.into()),
            None => parent["children"] = json!([child]),
        }
    }

    fn add_track(&mut self, track: &Track) {
        let kind = match track.property {
            Property::Translation | Property::Scale => "VEC3",
            Property::Rotation => "VEC4",
            Property::Weights => "SCALAR",
        };
        let interpolation = match track.interpolation {
            Interpolation::Step => "STEP",
            Interpolation::Linear => "LINEAR",
            Interpolation::CubicSpline => "CUBICSPLINE",
        };
        let (input, output) = (self.add_floats(&track.times, "SCALAR"), self.add_floats(&track.values, kind));
        let sampler =
            self.add("samplers of tracks", json!({ "input": input, "output": output, "interpolation": interpolation }));
        self.add(
            "channels",
            json!({ "sampler": sampler, "target": { "node": track.node, "path": track.property.name() } }),
        );
    }

    /// Adds nodes within each other that move an instance as a motion does: moved, where it rests, turned, and the rest of its
    /// transform. The last one, which has the mesh.
    pub(super) fn add_motion(&mut self, motion: &Motion, node: Value, transform: &DAffine3) -> Result<usize, Problem> {
        let moved = self.add("nodes", json!({ "name": node["name"] }));
        let at_rest = self.add_node(json!({}), &DAffine3::from_translation(transform.translation))?;
        let turned = self.add("nodes", json!({}));
        let inner = self.add_node(node, &DAffine3::from_mat3(transform.matrix3))?;
        [moved, at_rest, turned, inner].windows(2).for_each(|pair| self.add_child(pair[0], pair[1]));
        let mut add = |node: usize, property: Property, values: Vec<f64>| {
            let times = motion.keys.iter().map(|key| key.time as f32).collect();
            let values = values.into_iter().map(|x| x as f32).collect();
            self.add_track(&Track { node, property, interpolation: Interpolation::Linear, times, values });
        };
        let keys = || motion.keys.iter();
        add(moved, Property::Translation, keys().flat_map(|key| key.translation.to_array()).collect());
        add(turned, Property::Rotation, keys().flat_map(|key| key.rotation.to_array()).collect());
        Ok(inner)
    }

    /// Writes the reference to a part of the scene into the node that carries it, or into one within that if it has another
    /// one already; gives that node.
    pub(super) fn carry(&mut self, node: usize, member: &str, value: Value) -> Result<usize, Problem> {
        let own = self.arrays.get_mut("nodes").and_then(|nodes| nodes.get_mut(node));
        let own = own.ok_or_else(|| format!("it refers to node {node}, which does not exist"))?;
        if own.get(member).is_none() {
            own[member] = value;
            return Ok(node);
        }
        let child = self.add("nodes", json!({ member: value }));
        self.add_child(node, child);
        Ok(child)
    }

    /// Writes a mesh that deforms into the node that does it.
    pub(super) fn carry_deformed(
        &mut self,
        scene: &Scene,
        instance: usize,
        deformation: &Deformation,
        mesh: usize,
    ) -> Result<(), Problem> {
        let rig = &scene.animation.rig;
        let carrier = carrier(rig, Part::Instance(instance));
        let expected = deformation.skinning.is_none().then_some(deformation.node);
        let placed =
            carrier == expected && (expected.is_some() || scene.instances[instance].transform == DAffine3::IDENTITY);
        ensure!(
            placed,
            "instance {instance} deforms, and has another place than glTF would give it; let its node carry it"
        );
        let weights = &rig.nodes[deformation.node].weights;
        let node = &mut self.arrays.get_mut("nodes").ok_or("it has no nodes")?[deformation.node];
        node["mesh"] = json!(mesh);
        if !weights.is_empty() {
            node["weights"] = json!(weights);
        }
        if let Some(skinning) = &deformation.skinning {
            node["skin"] = json!(skinning.skin);
        }
        Ok(())
    }

    /// The animation of all tracks, and how its times go together with frames.
    pub(super) fn finish_animation(&mut self, scene: &Scene, extras: &mut Value) {
        let Some(channels) = self.arrays.remove("channels") else { return };
        let samplers = self.arrays.remove("samplers of tracks").unwrap_or_default();
        self.add("animations", json!({ "name": "animation", "channels": channels, "samplers": samplers }));
        let animation = &scene.animation;
        let times = exact::Times { frame_rate: animation.frame_rate, start: animation.start, period: animation.period };
        extras["times"] = json!(times);
    }
}

/// The node that carries a part of the scene.
pub(super) fn carrier(rig: &Rig, part: Part) -> Option<usize> {
    rig.attachments.iter().find(|attachment| attachment.part == part).map(|&Attachment { node, .. }| node)
}

/// The skins of the meshes that deform at each node: glTF has one at a node.
pub(super) fn check_skins(rig: &Rig) -> Result<(), Problem> {
    let skins: BTreeSet<_> = rig.deformations.iter().map(|d| (d.node, d.skinning.as_ref().map(|s| s.skin))).collect();
    let twice = skins.iter().zip(skins.iter().skip(1)).find(|(a, b)| a.0 == b.0);
    let name = |node: usize| rig.nodes.get(node).map(|node: &Node| node.name.clone()).unwrap_or_default();
    twice.map_or(Ok(()), |((node, _), _)| {
        Err(format!(
            "node {:?} deforms meshes by several skins, of which glTF has one; use a node for each",
            name(*node)
        ))
    })
}

/// The 16 numbers of an affine map, column by column.
fn matrix(columns: &[[f32; 3]; 4]) -> [f32; 16] {
    let [x, y, z, w] = columns;
    [x[0], x[1], x[2], 0.0, y[0], y[1], y[2], 0.0, z[0], z[1], z[2], 0.0, w[0], w[1], w[2], 1.0]
}
