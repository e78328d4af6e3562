//! Scenes far from the origin of their file.

use gltf::json::{Index, Node};

use super::{Importer, Problem};
use crate::scene::rig::carry;

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

    fn place_rig(&mut self) -> Result<(), Problem> {
        for (place, &node) in self.rigged.iter().enumerate() {
            let index: Index<Node> = Index::new(node as u32);
            let exact = self.exact_placement(self.document.get(index, "it refers to node")?, index)?;
            self.scene.animation.rig.nodes[place].placement = exact;
        }
        Ok(())
    }
}
