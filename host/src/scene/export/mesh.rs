//! Meshes.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::{Document, Problem};
use crate::error::ensure;
use crate::scene::{Deformation, Mesh, MorphTarget, Scene};

impl Document {
    /// Adds all meshes that have a triangle; gives the index in the file for each of the scene's. What a node deforms is one
    /// mesh of the file.
    pub(super) fn add_meshes(&mut self, scene: &Scene) -> Result<Vec<Option<usize>>, Problem> {
        let deformations = &scene.animation.rig.deformations;
        let deformation = |mesh: usize| deformations.iter().find(|deformation| deformation.mesh == mesh);
        let mut of_nodes = BTreeMap::new();
        let mut meshes = Vec::new();
        for (index, mesh) in scene.meshes.iter().enumerate() {
            let deformation = deformation(index);
            let primitive = self.primitive(mesh, deformation.map(|d| &**d), scene.materials.len())?;
            let shared = deformation.and_then(|deformation| of_nodes.get(&deformation.node)).copied();
            let own = primitive.map(|primitive| match shared {
                Some(shared) => self.add_primitive(shared, primitive),
                None => self.add("meshes", json!({ "name": mesh.name, "primitives": [primitive] })),
            });
            if let (Some(deformation), Some(own)) = (deformation, own) {
                of_nodes.insert(deformation.node, own);
            }
            meshes.push(own);
        }
        Ok(meshes)
    }

    fn add_primitive(&mut self, mesh: usize, primitive: Value) -> usize {
        let mesh_of_file = self.arrays.get_mut("meshes").and_then(|meshes| meshes.get_mut(mesh));
        let primitives = mesh_of_file.and_then(|mesh| mesh["primitives"].as_array_mut());
        primitives.into_iter().for_each(|primitives| primitives.push(primitive.clone()));
        mesh
    }

    fn primitive(
        &mut self,
        mesh: &Mesh,
        deformation: Option<&Deformation>,
        materials: usize,
    ) -> Result<Option<Value>, Problem> {
        if mesh.indices.is_empty() {
            return Ok(None);
        }
        check(mesh, materials).map_err(|problem| format!("mesh {:?}: {problem}", mesh.name))?;
        let mut attributes = json!({});
        self.add_attribute(&mut attributes, "POSITION", &mesh.positions);
        self.add_attribute(&mut attributes, "NORMAL", &mesh.normals);
        self.add_attribute(&mut attributes, "TEXCOORD_0", &mesh.uvs);
        self.add_attribute(&mut attributes, "TEXCOORD_1", &mesh.second_uvs);
        self.add_attribute(&mut attributes, "TANGENT", &mesh.tangents);
        let skinning = deformation.and_then(|deformation| deformation.skinning.as_ref());
        for (number, set) in skinning.iter().flat_map(|skinning| &skinning.sets).enumerate() {
            attributes[format!("JOINTS_{number}")] = self.add_joints(&set.joints).into();
            self.add_attribute(&mut attributes, &format!("WEIGHTS_{number}"), &set.weights);
        }
        let indices = self.add_triangles(&mesh.indices);
        let mut primitive = json!({ "attributes": attributes, "indices": indices, "material": mesh.material });
        let targets = deformation.map_or(&[][..], |deformation| &deformation.targets);
        if !targets.is_empty() {
            primitive["targets"] = targets.iter().map(|target| self.target(target, mesh.positions.len())).collect();
        }
        Ok(Some(primitive))
    }

    fn target(&mut self, target: &MorphTarget, vertices: usize) -> Value {
        let mut attributes = json!({});
        self.add_attribute(&mut attributes, "POSITION", &target.positions);
        self.add_attribute(&mut attributes, "NORMAL", &target.normals);
        self.add_attribute(&mut attributes, "TANGENT", &target.tangents);
        // a target has at least one attribute
        if attributes == json!({}) {
            self.add_attribute(&mut attributes, "POSITION", &vec![[0.0; 3]; vertices]);
        }
        attributes
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
    let counts = [mesh.normals.len(), mesh.uvs.len(), mesh.second_uvs.len(), mesh.tangents.len()];
    let other = counts.into_iter().find(|&count| count != 0 && count != vertices);
    other.map_or(Ok(()), |count| Err(format!("it has {vertices} vertices, and an attribute for {count}")))
}
