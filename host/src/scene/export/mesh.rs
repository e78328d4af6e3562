//! Meshes.

use serde_json::json;

use super::{Document, Problem};
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
        let mut attributes = json!({ "POSITION": self.binary.attribute(&mesh.positions, true) });
        if !mesh.normals.is_empty() {
            attributes["NORMAL"] = json!(self.binary.attribute(&mesh.normals, false));
        }
        if !mesh.uvs.is_empty() {
            attributes["TEXCOORD_0"] = json!(self.binary.attribute(&mesh.uvs, false));
        }
        if !mesh.tangents.is_empty() {
            attributes["TANGENT"] = json!(self.binary.attribute(&mesh.tangents, false));
        }
        let indices = self.binary.triangles(&mesh.indices);
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": mesh.material });
        self.meshes.push(json!({ "name": mesh.name, "primitives": [primitive] }));
        Ok(Some(self.meshes.len() - 1))
    }
}

fn check(mesh: &Mesh, materials: usize) -> Result<(), Problem> {
    if mesh.material >= materials {
        return Err(format!("it refers to material {}, which does not exist", mesh.material));
    }
    let vertices = mesh.positions.len();
    if let Some(index) = mesh.indices.as_flattened().iter().find(|&&index| index as usize >= vertices) {
        return Err(format!("it has an index {index} but only {vertices} vertices"));
    }
    if !mesh.positions.as_flattened().iter().all(|x| x.is_finite()) {
        return Err("the position of a vertex is not finite".to_owned());
    }
    let counts = [mesh.normals.len(), mesh.uvs.len(), mesh.tangents.len()];
    match counts.into_iter().find(|&count| count != 0 && count != vertices) {
        Some(count) => Err(format!("it has {vertices} vertices, and an attribute for {count}")),
        None => Ok(()),
    }
}
