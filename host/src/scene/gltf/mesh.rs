//! Meshes: each primitive becomes a mesh of the scene.

use std::collections::BTreeMap;
use std::ops::Range;

use gltf::json;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::{Importer, Problem, label};
use crate::scene::Mesh;

/// Which meshes of the scene came from which of the file.
pub(super) type Imported = BTreeMap<usize, Range<usize>>;

impl Importer<'_> {
    /// The scene's meshes for mesh `index` of the file; added when first asked for.
    pub(super) fn primitives(&mut self, index: usize) -> Result<Range<usize>, Problem> {
        if let Some(range) = self.meshes.get(&index) {
            return Ok(range.clone());
        }
        let root = self.document.root;
        let mesh = root.meshes.get(index).ok_or_else(|| format!("a node has mesh {index}, which does not exist"))?;
        let first = self.scene.meshes.len();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            self.add_primitive(primitive_name(mesh, index, number), primitive)?;
        }
        let range = first..self.scene.meshes.len();
        self.meshes.insert(index, range.clone());
        Ok(range)
    }

    fn add_primitive(&mut self, name: String, primitive: &Primitive) -> Result<(), Problem> {
        let in_mesh = |problem: Problem| format!("mesh {name}: {problem}");
        let Checked::Valid(mode) = primitive.mode else {
            return Err(in_mesh("it has an unknown primitive mode".to_owned()));
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.warn(format!("mesh {name}: points and lines are not rendered"));
            return Ok(());
        }
        let Some(&positions) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
            self.warn(format!("mesh {name}: it has no positions and was skipped"));
            return Ok(());
        };
        let positions = self.document.vectors::<3>(positions).map_err(in_mesh)?;
        let vertices = match primitive.indices {
            Some(indices) => self.document.integers(indices).map_err(in_mesh)?,
            None => (0..positions.len() as u32).collect(),
        };
        check(&positions, &vertices).map_err(in_mesh)?;
        let indices = triangles(mode, &vertices);
        let material = self.material(primitive).map_err(in_mesh)?;
        self.warn_of_losses(&name, primitive, mode, vertices.len(), indices.len());
        let mut mesh = Mesh { name, positions, indices, material, ..Mesh::default() };
        let needs = self.needs.get(material).copied().unwrap_or_default();
        self.add_attributes(&mut mesh, primitive, needs).map_err(|problem| format!("mesh {}: {problem}", mesh.name))?;
        self.scene.meshes.push(mesh);
        Ok(())
    }

    fn material(&mut self, primitive: &Primitive) -> Result<usize, Problem> {
        match primitive.material.map(|material| material.value()) {
            None => Ok(self.default_material()),
            Some(index) if index < self.document.root.materials.len() => Ok(index),
            Some(index) => Err(format!("it has material {index}, which does not exist")),
        }
    }

    fn warn_of_losses(&mut self, name: &str, primitive: &Primitive, mode: Mode, vertices: usize, triangles: usize) {
        if triangles == 0 {
            self.warn(format!("mesh {name}: it has no triangles"));
        } else if mode == Mode::Triangles && vertices != 3 * triangles {
            self.warn(format!("mesh {name}: its last triangle is incomplete and was skipped"));
        }
        if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
            self.warn(format!("mesh {name}: its morph targets are ignored"));
        }
    }
}

fn primitive_name(mesh: &json::Mesh, index: usize, number: usize) -> String {
    let name = label(mesh.name.as_ref(), "mesh", index);
    if mesh.primitives.len() == 1 { name } else { format!("{name}, primitive {number}") }
}

fn check(positions: &[[f32; 3]], vertices: &[u32]) -> Result<(), Problem> {
    if u32::try_from(positions.len()).is_err() {
        return Err(format!("it has {} vertices, more than 32-bit indices can tell apart", positions.len()));
    }
    if let Some(vertex) = positions.iter().position(|position| !position.iter().all(|x| x.is_finite())) {
        return Err(format!("the position of vertex {vertex} is not finite"));
    }
    match vertices.iter().find(|&&vertex| vertex as usize >= positions.len()) {
        Some(vertex) => Err(format!("it has an index {vertex} but only {} vertices", positions.len())),
        None => Ok(()),
    }
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
