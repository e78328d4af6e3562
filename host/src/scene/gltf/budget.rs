//! How much memory the import takes: a small file can refer to the same data, or to none, any number of times.

use gltf::json::animation::Sampler;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};

use super::deform::Deformer;
use super::{Document, Problem};
use crate::error::ensure;
use crate::error::gib;
use crate::memory;

/// The most bytes of the imported meshes, of the textures, of the files beside a document, and of the document itself:
/// 8 GiB, or what a render may take.
pub(super) fn max_bytes() -> u64 {
    memory::limit().min(8 << 30)
}

impl Document<'_> {
    /// Refuses meshes that would take more than [`max_bytes`], before the first is read.
    pub(super) fn check_memory(&self) -> Result<(), Problem> {
        let meshes = self.root.meshes.iter().zip(self.copies());
        let primitives = meshes.flat_map(|(mesh, copies)| mesh.primitives.iter().map(move |p| (p, copies)));
        let bytes = primitives.fold(0_u64, |sum, (primitive, copies)| {
            sum.saturating_add(self.primitive_bytes(primitive).saturating_mul(copies))
        });
        let bytes = bytes.saturating_add(self.motion_bytes());
        let most = max_bytes();
        let [taken, room] = [bytes, most].map(gib);
        ensure!(
            bytes <= most,
            "its meshes and animations take {taken}, more than the {room} that may be read; export fewer or simpler meshes"
        );
        Ok(())
    }

    /// How often each mesh is read: once, or by each node that deforms it.
    fn copies(&self) -> Vec<u64> {
        let mut copies = vec![1; self.root.meshes.len()];
        for (index, node) in self.root.nodes.iter().enumerate() {
            let Some(mesh) = node.mesh else { continue };
            if let Some(own) = self.root.meshes.get(mesh.value())
                && Deformer::of(Index::new(index as u32), node, own).is_some()
            {
                copies[mesh.value()] += 1;
            }
        }
        copies
    }

    /// The keys of all animations and the matrices of all skins.
    fn motion_bytes(&self) -> u64 {
        let samplers = self.root.animations.iter().flat_map(|animation| {
            animation.channels.iter().filter_map(|channel| animation.samplers.get(channel.sampler.value()))
        });
        let size = |sampler: &Sampler| {
            let [times, values] = [sampler.input, sampler.output].map(|accessor| self.elements_at_most(accessor));
            times
                .saturating_mul(size_of::<f32>() as u64)
                .saturating_add(values.saturating_mul(size_of::<[f32; 4]>() as u64))
        };
        let matrices = self.root.skins.iter().filter_map(|skin| skin.inverse_bind_matrices);
        let matrices =
            matrices.map(|accessor| self.elements_at_most(accessor).saturating_mul(size_of::<[f32; 16]>() as u64));
        samplers.map(size).chain(matrices).fold(0, u64::saturating_add)
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
                Checked::Valid(Semantic::Tangents | Semantic::Weights(_)) => size_of::<[f32; 4]>(),
                Checked::Valid(Semantic::Joints(_)) => size_of::<[u16; 4]>(),
                _ => 0,
            };
            (self.elements_at_most(accessor), bytes)
        });
        let targets = primitive.targets.iter().flatten();
        let deltas = targets.flat_map(|target| [target.positions, target.normals, target.tangents]).flatten();
        let deltas = deltas.map(|accessor| (self.elements_at_most(accessor), size_of::<[f32; 3]>()));
        let own = [(indices, size_of::<u32>()), (triangles, size_of::<[u32; 3]>())];
        let parts = attributes.chain(deltas).chain(own);
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
