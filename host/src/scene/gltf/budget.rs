//! How much memory the import takes: a small file can refer to the same data, or to none, any number of times.

use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};

use super::{Document, Problem};
use crate::error::ensure;
use crate::memory::{self, gib};

/// The most bytes of the imported meshes, of the textures, of the files beside a document, and of the document itself:
/// 8 GiB, or what a render may take.
pub(super) fn max_bytes() -> Result<u64, Problem> {
    memory::limit().map(|limit| limit.min(8 << 30)).map_err(|error| error.to_string())
}

impl Document<'_> {
    /// Refuses meshes that would take more than [`max_bytes`], before the first is read.
    pub(super) fn check_memory(&self) -> Result<(), Problem> {
        let primitives = self.root.meshes.iter().flat_map(|mesh| &mesh.primitives);
        let bytes = primitives.fold(0_u64, |sum, primitive| sum.saturating_add(self.primitive_bytes(primitive)));
        let most = max_bytes()?;
        let [taken, room] = [bytes, most].map(gib);
        ensure!(
            bytes <= most,
            "its meshes take {taken}, more than the {room} that may be read; export fewer or simpler meshes"
        );
        Ok(())
    }

    fn primitive_bytes(&self, primitive: &Primitive) -> u64 {
        let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
        let positions = positions.map_or(0, |&accessor| self.elements_at_most(accessor));
        let indices = primitive.indices.map_or(positions, |accessor| self.elements_at_most(accessor));
        let triangles = if primitive.mode == Checked::Valid(Mode::Triangles) { indices / 3 } else { indices };
        let attributes = primitive.attributes.iter().map(|(semantic, &accessor)| {
            let bytes = match semantic {
                Checked::Valid(Semantic::Positions | Semantic::Normals) => size_of::<[f32; 3]>(),
                Checked::Valid(Semantic::TexCoords(_)) => size_of::<[f32; 2]>(),
                Checked::Valid(Semantic::Tangents) => size_of::<[f32; 4]>(),
                _ => 0,
            };
            (self.elements_at_most(accessor), bytes)
        });
        let parts = attributes.chain([(indices, size_of::<u32>()), (triangles, size_of::<[u32; 3]>())]);
        parts.fold(0, |sum, (count, bytes)| sum.saturating_add(count.saturating_mul(bytes as u64)))
    }

    /// How many elements an accessor can have: none if it is broken, which its reader explains.
    fn elements_at_most(&self, index: Index<Accessor>) -> u64 {
        let Some(accessor) = self.root.accessors.get(index.value()) else {
            return 0;
        };
        let most = match accessor.buffer_view {
            Some(view) => self.view(view).map_or(0, |(bytes, _)| bytes.len() as u64),
            None => super::accessor::MAX_IMPLICIT_ELEMENTS,
        };
        accessor.count.0.min(most)
    }
}
