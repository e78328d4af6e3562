//! The rig: of the file's nodes those that move, or carry what moves.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use gltf::json::{Index, Node as JsonNode};

use super::{Importer, Problem, node::placement};
use crate::error::ensure;
use crate::scene::{Attachment, Deformation, Node, Part, Rig, Skinning, Track};

/// What of the file moves. Nodes and skins have their indices in the file.
#[derive(Default)]
pub(super) struct Movers {
    /// Nodes of the scene with their parents, which come first.
    pub(super) nodes: Vec<(usize, Option<usize>)>,
    pub(super) attachments: Vec<(usize, Part)>,
    pub(super) deformations: Vec<Deformation>,
}

impl Importer<'_> {
    /// Makes the rig of what was found to move.
    pub(super) fn add_rig(&mut self) -> Result<(), Problem> {
        let Movers { nodes, attachments, deformations } = std::mem::take(&mut self.movers);
        let skin_indices: BTreeSet<usize> =
            deformations.iter().filter_map(|d| Some(d.skinning.as_ref()?.skin)).collect();
        let read = |&index: &usize| self.skin(Index::new(index as u32));
        let mut skins = skin_indices.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        let movers = attachments.iter().map(|(node, _)| *node).chain(deformations.iter().map(|d| d.node));
        let places = places(&nodes, movers.chain(skins.iter().flat_map(|skin| skin.joints.iter().copied())));
        for skin in &mut skins {
            for joint in &mut skin.joints {
                let place = places.get(joint);
                ensure!(place.is_some(), "skin {} has joint {joint}, a node that is not in the scene", skin.name);
                *joint = place.copied().unwrap_or_default();
            }
        }
        let skin_place = |skin| skin_indices.range(..skin).count();
        let mut rig = Rig { skins, ..Rig::default() };
        for &(index, parent) in nodes.iter().filter(|(index, _)| places.contains_key(index)) {
            self.rigged.push(index);
            rig.nodes.push(self.node(index, parent.map(|parent| places[&parent]))?);
        }
        rig.attachments = attachments.iter().map(|&(node, part)| Attachment { node: places[&node], part }).collect();
        let placed = |deformation: Deformation| {
            let skinning = deformation.skinning.map(|s| Skinning { skin: skin_place(s.skin), ..s });
            Arc::new(Deformation { node: places[&deformation.node], skinning, ..deformation })
        };
        rig.deformations = deformations.into_iter().map(placed).collect();
        let tracks = std::mem::take(&mut self.tracks).into_iter();
        rig.tracks = tracks.filter_map(|track| Some(Track { node: *places.get(&track.node)?, ..track })).collect();
        rig.check(&self.scene)?;
        self.scene.animation.rig = rig;
        Ok(())
    }

    fn node(&self, index: usize, parent: Option<usize>) -> Result<Node, Problem> {
        let own: Index<JsonNode> = Index::new(index as u32);
        let node = self.document.get(own, "it refers to node")?;
        let targets = node.mesh.and_then(|mesh| self.document.root.meshes.get(mesh.value()));
        let targets = targets.and_then(|mesh| {
            let count = mesh.primitives.iter().find_map(|primitive| Some(primitive.targets.as_ref()?.len()));
            mesh.weights.clone().or_else(|| count.map(|count| vec![0.0; count]))
        });
        let weights = node.weights.clone().or(targets).unwrap_or_default();
        let name = node.name.clone().unwrap_or_default();
        Ok(Node { name, parent, placement: placement(node, own)?, weights })
    }
}

/// The places in the rig of nodes that are needed, and of those that they are within.
fn places(nodes: &[(usize, Option<usize>)], needed: impl Iterator<Item = usize>) -> BTreeMap<usize, usize> {
    let parents: BTreeMap<usize, Option<usize>> = nodes.iter().copied().collect();
    let mut kept = BTreeSet::new();
    for node in needed {
        let mut next = parents.contains_key(&node).then_some(node);
        while let Some(node) = next.filter(|node| kept.insert(*node)) {
            next = parents[&node];
        }
    }
    nodes.iter().map(|(node, _)| *node).filter(|node| kept.contains(node)).zip(0..).collect()
}
