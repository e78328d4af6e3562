//! Meshes: each primitive becomes a mesh of the scene.

use std::ops::Range;
use std::sync::Arc;

use gltf::json::mesh::{Mesh as JsonMesh, Mode, Primitive, Semantic};
use gltf::json::{Index, validation::Checked};

use super::deform::Deformer;
use super::{DRACO, Importer, Problem, label};
use crate::error::ensure;
use crate::scene::Mesh;
use crate::scene::closed::is_closed;

impl Importer<'_> {
    /// The scene's meshes for a mesh of the file; added when first asked for.
    pub(super) fn primitives(&mut self, index: Index<JsonMesh>) -> Result<Range<usize>, Problem> {
        if let Some(range) = self.meshes.get(&index) {
            return Ok(range.clone());
        }
        let range = self.add_mesh(index, None)?;
        self.meshes.insert(index, range.clone());
        Ok(range)
    }

    /// Adds a mesh of the file once more, for a node that deforms it.
    pub(super) fn add_mesh(
        &mut self,
        index: Index<JsonMesh>,
        deformer: Option<Deformer>,
    ) -> Result<Range<usize>, Problem> {
        let mesh = self.document.get(index, "a node has mesh")?;
        let first = self.scene.meshes.len();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let name = label(mesh.name.as_ref(), "mesh", index);
            let name = if mesh.primitives.len() == 1 { name } else { format!("{name}, primitive {number}") };
            self.about(format!("mesh {name}"), |importer| importer.add_primitive(name, primitive, deformer))?;
        }
        let added = first..self.scene.meshes.len();
        self.warn_of_open_volumes(added.clone(), label(mesh.name.as_ref(), "mesh", index));
        Ok(added)
    }

    /// A volume is what the surface of a body encloses, and all of its primitives are that surface.
    fn warn_of_open_volumes(&mut self, meshes: Range<usize>, name: String) {
        let meshes = &self.scene.meshes[meshes];
        let has_volume = meshes.iter().any(|mesh| self.scene.materials[mesh.material].volume.is_some());
        if has_volume && !is_closed(&joined(meshes)) {
            self.warn(format!(
                "mesh {name}: its material has a volume, and it is not closed, so that light which enters does not leave as from a body; close it, \
                 or set the thickness of a sheet to 0"
            ));
        }
    }

    fn add_primitive(
        &mut self,
        name: String,
        primitive: &Primitive,
        deformer: Option<Deformer>,
    ) -> Result<(), Problem> {
        let Checked::Valid(mode) = primitive.mode else {
            return Err("it has an unknown primitive mode".to_owned());
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.warn("points and lines are not rendered");
            return Ok(());
        }
        let Some(&positions) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
            self.warn("it has no positions and was skipped");
            return Ok(());
        };
        // a file may have the same mesh in plain form
        let compressed = primitive.extensions.as_ref().is_some_and(|extensions| extensions.others.contains_key(DRACO));
        let accessor = self.document.get(positions, "it has accessor")?;
        let empty = accessor.buffer_view.is_none() && accessor.sparse.is_none();
        ensure!(!(compressed && empty), "it is compressed by {DRACO}, which is not supported; export it without");
        let positions = self.document.vectors::<3>(positions)?;
        let vertices = match primitive.indices {
            Some(indices) => self.document.integers(indices)?,
            None => (0..positions.len() as u32).collect(),
        };
        check(&positions, &vertices)?;
        let indices = triangles(mode, &vertices);
        let material = self.material(primitive)?;
        self.warn_of_losses(primitive, mode, vertices.len(), indices.len());
        let mut mesh = Mesh { name, positions, indices, material, ..Mesh::default() };
        let needs = self.needs.get(material).copied().unwrap_or_default();
        self.add_attributes(&mut mesh, primitive, needs)?;
        if let Some(deformer) = deformer {
            let deformation = self.deformation(self.scene.meshes.len(), &mesh, primitive, deformer)?;
            self.movers.deformations.push(deformation);
        }
        self.scene.meshes.push(mesh.into());
        Ok(())
    }

    fn material(&mut self, primitive: &Primitive) -> Result<usize, Problem> {
        let Some(index) = primitive.material else {
            return Ok(self.default_material());
        };
        self.document.get(index, "it has material").map(|_| index.value())
    }

    fn warn_of_losses(&mut self, primitive: &Primitive, mode: Mode, vertices: usize, triangles: usize) {
        self.warn_if(triangles == 0, "it has no triangles");
        let incomplete = mode == Mode::Triangles && triangles > 0 && vertices != 3 * triangles;
        self.warn_if(incomplete, "its last triangle is incomplete and was skipped");
        let is_color = |semantic: &Checked<Semantic>| matches!(semantic, Checked::Valid(Semantic::Colors(_)));
        self.warn_if(primitive.attributes.keys().any(is_color), "its vertex colours are ignored");
    }
}

/// The triangles of several meshes as one.
fn joined(meshes: &[Arc<Mesh>]) -> Mesh {
    let mut all = Mesh::default();
    for mesh in meshes {
        let first = all.positions.len() as u32;
        all.positions.extend(&mesh.positions);
        all.indices.extend(mesh.indices.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
    }
    all
}

fn check(positions: &[[f32; 3]], vertices: &[u32]) -> Result<(), Problem> {
    let count = positions.len();
    ensure!(u32::try_from(count).is_ok(), "it has {count} vertices, more than 32-bit indices can tell apart");
    if let Some(vertex) = positions.iter().position(|position| !position.iter().all(|x| x.is_finite())) {
        return Err(format!("the position of vertex {vertex} is not finite"));
    }
    let beyond = vertices.iter().find(|&&vertex| vertex as usize >= count);
    beyond.map_or(Ok(()), |vertex| Err(format!("it has an index {vertex} but only {count} vertices")))
}

/// The triangles of a list, strip or fan, all wound as the first.
fn triangles(mode: Mode, vertices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => {
            let strip = vertices.array_windows::<3>().enumerate();
            strip.map(|(i, &[a, b, c])| if i % 2 == 0 { [a, b, c] } else { [a, c, b] }).collect()
        }
        Mode::TriangleFan => match vertices.split_first() {
            Some((&hub, rim)) => rim.array_windows::<2>().map(|&[a, b]| [hub, a, b]).collect(),
            None => Vec::new(),
        },
        _ => vertices.as_chunks::<3>().0.to_vec(),
    }
}
