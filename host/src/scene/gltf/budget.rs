//! How much memory the import takes: a small file can refer to the same data, or to none, any number of times.

use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};

use super::{Document, Problem};
use crate::memory;

/// The most bytes of the imported meshes, of the textures, of the files beside a document, and of the document itself:
/// 8 GiB, or what a render may take.
pub(super) fn max_bytes() -> Result<u64, Problem> {
    memory::limit().map(|limit| limit.min(8 << 30)).map_err(|error| error.to_string())
}

/// Bytes as a text in GiB.
pub(super) fn gib(bytes: u64) -> String {
    format!("{:.2} GiB", bytes as f64 / f64::from(1 << 30))
}

const POSITION_BYTES: u64 = 12;
const NORMAL_BYTES: u64 = 12;
const UV_BYTES: u64 = 8;
const TANGENT_BYTES: u64 = 16;
const INDEX_BYTES: u64 = 4;
const TRIANGLE_BYTES: u64 = 12;

impl Document<'_> {
    /// Refuses meshes that would take more than [`max_bytes`], before the first is read.
    pub(super) fn check_memory(&self) -> Result<(), Problem> {
        let primitives = self.root.meshes.iter().flat_map(|mesh| &mesh.primitives);
        let bytes = primitives.fold(0_u64, |sum, primitive| sum.saturating_add(self.primitive_bytes(primitive)));
        let most = max_bytes()?;
        if bytes <= most {
            return Ok(());
        }
        Err(format!(
            "its meshes take {}, more than the {} that may be read; export fewer or simpler meshes",
            gib(bytes),
            gib(most)
        ))
    }

    fn primitive_bytes(&self, primitive: &Primitive) -> u64 {
        let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
        let positions = positions.map_or(0, |&accessor| self.elements_at_most(accessor));
        let indices = primitive.indices.map_or(positions, |accessor| self.elements_at_most(accessor));
        let triangles = if primitive.mode == Checked::Valid(Mode::Triangles) { indices / 3 } else { indices };
        let others = primitive.attributes.iter().filter_map(|(semantic, &accessor)| {
            let bytes = match semantic {
                Checked::Valid(Semantic::Normals) => NORMAL_BYTES,
                Checked::Valid(Semantic::TexCoords(_)) => UV_BYTES,
                Checked::Valid(Semantic::Tangents) => TANGENT_BYTES,
                _ => return None,
            };
            Some((self.elements_at_most(accessor), bytes))
        });
        let parts = [(positions, POSITION_BYTES), (indices, INDEX_BYTES), (triangles, TRIANGLE_BYTES)];
        parts.into_iter().chain(others).fold(0, |sum, (count, bytes)| sum.saturating_add(count.saturating_mul(bytes)))
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
