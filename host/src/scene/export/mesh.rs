//! Meshes.

use serde_json::json;

use super::{Document, Problem};
use crate::error::ensure;
use crate::scene::{Mesh, Scene};

impl Document {
    /// Adds all meshes that have a triangle; gives the index in the file for each of the scene's.
    pub(super) fn add_meshes(&mut self, scene: &Scene) -> Result<Vec<Option<usize>>, Problem> {
        scene.meshes.iter().map(|mesh| self.add_mesh(mesh, scene.materials.len())).collect()
    }

    fn add_mesh(&mut self, mesh: &Mesh, materials: usize) -> Result<Option<usize>, Problem> {
        if mesh.indices.is_empty() {
            return Ok(None);
        }
        check(mesh, materials).map_err(|problem| format!("mesh {:?}: {problem}", mesh.name))?;
        let mut attributes = json!({});
        self.add_attribute(&mut attributes, "POSITION", &mesh.positions);
        self.add_attribute(&mut attributes, "NORMAL", &mesh.normals);
        self.add_attribute(&mut attributes, "TEXCOORD_0", &mesh.uvs);
        self.add_attribute(&mut attributes, "TANGENT", &mesh.tangents);
        let indices = self.add_triangles(&mesh.indices);
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": mesh.material });
        Ok(Some(self.add("meshes", json!({ "name": mesh.name, "primitives": [primitive] }))))
    }
}

fn check(mesh: &Mesh, materials: usize) -> Result<(), Problem> {
    ensure!(mesh.material < materials, "it refers to material {}, which does not exist", mesh.material);
    let vertices = mesh.positions.len();
    if let Some(index) = mesh.indices.as_flattened().iter().find(|&&index| index as usize >= vertices) {
        return Err(format!("it has an index {index} but only {vertices} vertices"));
    }
    let finite = mesh.positions.as_flattened().iter().all(|x| x.is_finite());
    ensure!(finite, "the position of a vertex is not finite");
    let counts = [mesh.normals.len(), mesh.uvs.len(), mesh.tangents.len()];
    let other = counts.into_iter().find(|&count| count != 0 && count != vertices);
    other.map_or(Ok(()), |count| Err(format!("it has {vertices} vertices, and an attribute for {count}")))
}
