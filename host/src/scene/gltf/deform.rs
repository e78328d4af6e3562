//! What deforms meshes: morph targets and the joints of skins.

use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index, Node, Skin as JsonSkin};

use super::{Importer, Problem, label};
use crate::error::ensure;
use crate::scene::{Deformation, Influences, Mesh, MorphTarget, Skin, Skinning};

/// The node that deforms a mesh, by its weights and perhaps by a skin.
#[derive(Clone, Copy)]
pub(super) struct Deformer {
    pub(super) node: Index<Node>,
    pub(super) skin: Option<Index<JsonSkin>>,
}

impl Deformer {
    /// That of a node whose mesh needs one.
    pub(super) fn of(index: Index<Node>, node: &Node, mesh: &gltf::json::Mesh) -> Option<Self> {
        let morphs = mesh.primitives.iter().any(|primitive| primitive.targets.as_ref().is_some_and(|t| !t.is_empty()));
        (morphs || node.skin.is_some()).then_some(Self { node: index, skin: node.skin })
    }
}

impl Importer<'_> {
    /// How a primitive deforms, which is mesh `index` of the scene; node and skin have their indices in the file.
    pub(super) fn deformation(
        &self,
        index: usize,
        mesh: &Mesh,
        primitive: &Primitive,
        Deformer { node, skin }: Deformer,
    ) -> Result<Deformation, Problem> {
        let targets = self.targets(mesh, primitive)?;
        let skinning = match skin {
            Some(skin) => Some(Skinning { skin: skin.value(), sets: self.influences(primitive)? }),
            None => None,
        };
        Ok(Deformation { mesh: index, node: node.value(), targets, skinning })
    }

    fn targets(&self, mesh: &Mesh, primitive: &Primitive) -> Result<Vec<MorphTarget>, Problem> {
        let deltas = |accessor: Option<Index<Accessor>>, wanted: bool| {
            let accessor = accessor.filter(|_| wanted);
            accessor.map_or(Ok(Vec::new()), |accessor| self.document.vectors::<3>(accessor))
        };
        let [shaded, mapped] = [!mesh.normals.is_empty(), !mesh.tangents.is_empty()];
        let targets = primitive.targets.iter().flatten().map(|target| {
            Ok(MorphTarget {
                positions: deltas(target.positions, true)?,
                normals: deltas(target.normals, shaded)?,
                tangents: deltas(target.tangents, mapped)?,
            })
        });
        targets.collect()
    }

    fn influences(&self, primitive: &Primitive) -> Result<Vec<Influences>, Problem> {
        let attribute = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let mut sets = Vec::new();
        while let Some(joints) = attribute(Semantic::Joints(sets.len() as u32)) {
            let set = sets.len();
            let weights = attribute(Semantic::Weights(set as u32));
            let weights =
                weights.ok_or_else(|| format!("it has JOINTS_{set} but no WEIGHTS_{set}; export it with both"))?;
            sets.push(Influences {
                joints: self.document.joints(joints)?,
                weights: self.document.vectors::<4>(weights)?,
            });
        }
        ensure!(!sets.is_empty(), "its node has a skin, but it has no JOINTS_0; export it with joints and weights");
        Ok(sets)
    }

    /// A skin, whose joints have their indices in the file.
    pub(super) fn skin(&self, index: Index<JsonSkin>) -> Result<Skin, Problem> {
        let skin = self.document.get(index, "a node has skin")?;
        let name = label(skin.name.as_ref(), "skin", index);
        let matrices = skin.inverse_bind_matrices.map(|accessor| self.document.affine_matrices(accessor)).transpose();
        let mut inverse_bind = matrices.map_err(|problem| format!("skin {name}: {problem}"))?.unwrap_or_default();
        let (joints, found) = (skin.joints.len(), inverse_bind.len());
        ensure!(joints > 0, "skin {name} has no joints; export it again");
        let enough = skin.inverse_bind_matrices.is_none() || found >= joints;
        ensure!(enough, "skin {name} has {joints} joints, and inverse bind matrices for {found}; export it again");
        inverse_bind.truncate(joints);
        Ok(Skin { name, joints: skin.joints.iter().map(Index::value).collect(), inverse_bind })
    }
}
