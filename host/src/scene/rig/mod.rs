//! Nodes that move with time, what they carry, and the meshes that they deform.

use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};

use super::{Camera, LightKind, Scene, double};

mod check;
mod deform;
mod track;

pub use track::{Interpolation, Property, Track};

/// Nodes in trees, as glTF has them, and what of a scene follows them. Only what moves needs to be here: empty in a
/// scene whose instances stand where their transforms say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// Parents before their children.
    pub nodes: Vec<Node>,
    /// How nodes change with time; each property of a node at most once.
    pub tracks: Vec<Track>,
    /// What the nodes carry; each part of the scene at most once.
    pub attachments: Vec<Attachment>,
    /// Joints that meshes hang on.
    pub skins: Vec<Skin>,
    /// Meshes whose vertices move; each mesh at most once.
    pub deformations: Vec<Arc<Deformation>>,
}

/// A node: a space within that of its parent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Node {
    /// Name for messages.
    pub name: String,
    /// Index into [`Rig::nodes`]; `None` for a node in the world.
    pub parent: Option<usize>,
    /// From the node's space to its parent's, where no track says otherwise.
    pub placement: Placement,
    /// Weights of the morph targets of its meshes, where no track says otherwise.
    pub weights: Vec<f32>,
}

/// The transform of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Placement {
    /// Any affine map. Tracks cannot change it.
    Matrix(DAffine3),
    /// Scaled, then turned, then moved.
    Parts {
        /// In units of length.
        translation: [f64; 3],
        /// A quaternion x, y, z, w of any length but zero.
        rotation: [f64; 4],
        /// Factors along the axes.
        scale: [f64; 3],
    },
}

/// A part of the scene that a node carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Index into [`Rig::nodes`].
    pub node: usize,
    /// What it carries.
    pub part: Part,
}

/// What a node can carry. It has the node's transform instead of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Part {
    /// An instance, by its index.
    Instance(usize),
    /// A light, by its index: at the node's origin, shining along its -z.
    Light(usize),
    /// The scene's camera: at the node's origin, looking along its -z with +y up. Its field of view and lens stay.
    Camera,
}

/// Joints, and where they were when meshes were hung on them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    /// Name for messages.
    pub name: String,
    /// Indices into [`Rig::nodes`].
    pub joints: Vec<usize>,
    /// For each joint the affine map from the mesh's space to the joint's, as three columns and a translation; identities
    /// if there are none.
    pub inverse_bind: Vec<[[f32; 3]; 4]>,
}

/// How the vertices of a mesh move: by morph targets, and then by the joints of a skin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deformation {
    /// Index into [`Scene::meshes`], which has the mesh with neither.
    pub mesh: usize,
    /// The node that has the weights of the targets.
    pub node: usize,
    /// As many as the node has weights.
    pub targets: Vec<MorphTarget>,
    /// The skin, if there is one. It places vertices in the world: the mesh's instance has the identity.
    pub skinning: Option<Skinning>,
}

/// What is added to the vertices of a mesh, times a weight: a displacement for each vertex, or none at all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MorphTarget {
    /// What is added to positions.
    pub positions: Vec<[f32; 3]>,
    /// What is added to normals; the sum is made a unit vector.
    pub normals: Vec<[f32; 3]>,
    /// What is added to tangents; the sum is made a unit vector.
    pub tangents: Vec<[f32; 3]>,
}

/// Which joints move a vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skinning {
    /// Index into [`Rig::skins`].
    pub skin: usize,
    /// Four joints a vertex in each, as glTF's `JOINTS_0` and `WEIGHTS_0`, `JOINTS_1` and so on.
    pub sets: Vec<Influences>,
}

/// Four joints of each vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Influences {
    /// Indices into [`Skin::joints`], four a vertex.
    pub joints: Vec<[u16; 4]>,
    /// Their shares, not negative; those of a vertex are divided by their sum over all sets.
    pub weights: Vec<[f32; 4]>,
}

impl Default for Placement {
    fn default() -> Self {
        Self::Parts { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0], scale: [1.0; 3] }
    }
}

impl Placement {
    /// The transform, with those parts that tracks give.
    fn transform(&self, changed: &Changed) -> DAffine3 {
        match *self {
            Self::Matrix(matrix) => matrix,
            Self::Parts { translation, rotation, scale } => DAffine3::from_scale_rotation_translation(
                changed.scale.unwrap_or(scale.into()),
                unit(changed.rotation.unwrap_or_else(|| DQuat::from_array(rotation))),
                changed.translation.unwrap_or(translation.into()),
            ),
        }
    }

    /// The transform where no track changes it.
    pub(super) fn at_rest(&self) -> DAffine3 {
        self.transform(&Changed::default())
    }
}

/// A unit quaternion; no turn for zero, which a cubic spline may pass.
fn unit(rotation: DQuat) -> DQuat {
    let length = rotation.length();
    if length > 0.0 && length.is_finite() { rotation.normalize() } else { DQuat::IDENTITY }
}

/// What the tracks say of a node at a time.
#[derive(Clone, Debug, Default)]
struct Changed {
    translation: Option<DVec3>,
    rotation: Option<DQuat>,
    scale: Option<DVec3>,
    weights: Option<Vec<f64>>,
}

/// A node at a time.
struct Placed {
    /// From its space to the scene's.
    world: DAffine3,
    weights: Vec<f64>,
}

impl Rig {
    /// Poses a scene, whose meshes are those of rest, as at a time in the units of the tracks. What [`Self::check`]
    /// refuses stays as it is.
    pub(super) fn pose(&self, scene: &mut Scene, time: f64) {
        let nodes = self.placed(time, scene.origin);
        for Attachment { node, part } in &self.attachments {
            if let Some(node) = nodes.get(*node) {
                carry(scene, *part, &node.world);
            }
        }
        for deformation in &self.deformations {
            let joints = deformation.skinning.as_ref().and_then(|skinning| self.joints(skinning.skin, &nodes));
            let (Some(mesh), Some(node)) = (scene.meshes.get_mut(deformation.mesh), nodes.get(deformation.node)) else {
                continue;
            };
            *mesh = Arc::new(deformation.apply(mesh, &node.weights, joints.as_deref()));
        }
    }

    /// The camera of a scene of that origin at a time.
    pub(super) fn camera(&self, camera: Camera, time: f64, origin: DVec3) -> Camera {
        let carrying = self.attachments.iter().find(|attachment| attachment.part == Part::Camera);
        let world = carrying.and_then(|attachment| Some(self.placed(time, origin).get(attachment.node)?.world));
        world.map_or(camera, |world| camera.carried(&world))
    }

    /// The nodes in coordinates relative to a point of the world.
    fn placed(&self, time: f64, origin: DVec3) -> Vec<Placed> {
        let world = DAffine3::from_translation(DVec3::ZERO - origin);
        let mut changed = vec![Changed::default(); self.nodes.len()];
        for track in &self.tracks {
            if let Some(changed) = changed.get_mut(track.node) {
                track.change(changed, time);
            }
        }
        let mut placed: Vec<Placed> = Vec::with_capacity(self.nodes.len());
        for (node, changed) in self.nodes.iter().zip(changed) {
            let parent = node.parent.and_then(|parent| placed.get(parent)).map_or(world, |p| p.world);
            let world = parent * node.placement.transform(&changed);
            let weights = changed.weights.unwrap_or_else(|| node.weights.iter().copied().map(f64::from).collect());
            placed.push(Placed { world, weights });
        }
        placed
    }

    /// From the space of a mesh at rest to the world, by each joint of a skin.
    fn joints(&self, skin: usize, nodes: &[Placed]) -> Option<Vec<DAffine3>> {
        let skin = self.skins.get(skin)?;
        let matrix = |(number, joint): (usize, &usize)| {
            let world = nodes.get(*joint)?.world;
            Some(skin.inverse_bind.get(number).map_or(world, |columns| world * affine(columns)))
        };
        skin.joints.iter().enumerate().map(matrix).collect()
    }

    /// The scene's camera stays where it is.
    pub fn release_camera(&mut self) {
        self.attachments.retain(|attachment| attachment.part != Part::Camera);
    }
}

/// An affine map from its columns.
fn affine(columns: &[[f32; 3]; 4]) -> DAffine3 {
    let [x, y, z, w] = columns.map(double);
    DAffine3::from_cols(x, y, z, w)
}

/// Moves a part of a scene to where a node is.
pub(super) fn carry(scene: &mut Scene, part: Part, world: &DAffine3) {
    match part {
        Part::Instance(index) => {
            if let Some(instance) = scene.instances.get_mut(index) {
                instance.transform = *world;
            }
        }
        Part::Light(index) => {
            if let Some(light) = scene.lights.get_mut(index) {
                light.kind = light.kind.carried(world);
            }
        }
        Part::Camera => scene.camera = scene.camera.map(|camera| camera.carried(world)),
    }
}

impl LightKind {
    /// The light at the origin of a node, shining along its -z.
    pub(super) fn carried(self, world: &DAffine3) -> Self {
        let position = world.translation;
        let direction = world.transform_vector3(DVec3::NEG_Z);
        match self {
            Self::Point { .. } => Self::Point { position },
            Self::Directional { .. } => Self::Directional { direction },
            Self::Spot { inner, outer, .. } => Self::Spot { position, direction, inner, outer },
        }
    }
}

#[cfg(test)]
mod tests;
