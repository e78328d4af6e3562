//! Scenes far from the origin of their file.

use std::collections::BTreeSet;

use gltf::json::{Index, Node};

use super::{Importer, Problem};
use crate::scene::rig::carry;
use crate::scene::{Placement, Property};

impl Importer<'_> {
    /// Moves a scene that is far from the origin near it. Its nodes are read once more, in double precision: single precision has
    /// rounded where they are by what is then seen. Near the origin it has not, and scenes keep the bits that they always had.
    pub(super) fn move_to_origin(&mut self) -> Result<(), Problem> {
        if self.scene.far_middle().is_none() {
            return Ok(());
        }
        for (part, world) in std::mem::take(&mut self.places) {
            carry(&mut self.scene, part, &world);
        }
        self.place_rig()?;
        self.scene.move_to_origin();
        Ok(())
    }

    /// Nodes that tracks move stay in single precision, as the tracks are.
    fn place_rig(&mut self) -> Result<(), Problem> {
        let tracks = self.scene.animation.rig.tracks.iter().filter(|track| track.property != Property::Weights);
        let moved: BTreeSet<usize> = tracks.map(|track| track.node).collect();
        for (place, &node) in self.rigged.iter().enumerate().filter(|(place, _)| !moved.contains(place)) {
            let index: Index<Node> = Index::new(node as u32);
            let exact = self.exact_placement(self.document.get(index, "it refers to node")?, index)?;
            self.scene.animation.rig.nodes[place].placement = Placement::Matrix(exact);
        }
        Ok(())
    }
}
