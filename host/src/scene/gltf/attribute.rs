//! Vertex attributes: normals, texture coordinates and tangents.

use glam::DVec3;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

use super::material::Needs;
use super::{Importer, Problem};
use crate::error::ensure;
use crate::scene::{MAX_COORDINATE, Mesh, double};

/// How far from 1 the length of a vector may be that is taken as it is: rounding to single precision is 1e-7.
const UNIT_TOLERANCE: f64 = 1e-6;

impl Importer<'_> {
    /// Reads what a mesh with its positions and triangles lacks; of the texture coordinates and tangents only what its
    /// material needs.
    pub(super) fn add_attributes(
        &mut self,
        mesh: &mut Mesh,
        primitive: &Primitive,
        needs: Needs,
    ) -> Result<(), Problem> {
        mesh.normals = self.normals(mesh, primitive)?;
        let [first, second] = needs.uv_sets.map(|set| self.uvs(mesh, primitive, set));
        (mesh.uvs, mesh.second_uvs) = (first?, second?);
        if needs.tangents && !(mesh.uvs.is_empty() || mesh.normals.is_empty()) {
            // without normals a mesh is flat, and tangents that it has are of other ones (glTF 2.0, 3.7.2.1)
            mesh.tangents = self.tangents(mesh, primitive)?;
        }
        Ok(())
    }

    fn uvs(&mut self, mesh: &Mesh, primitive: &Primitive, set: Option<u32>) -> Result<Vec<[f32; 2]>, Problem> {
        let Some(set) = set else { return Ok(Vec::new()) };
        let uvs = self.attribute::<2>(mesh, primitive, Semantic::TexCoords(set), "texture coordinates")?;
        let warning = format!("it has no texture coordinates {set} for the textures of its material");
        self.warn_if(uvs.is_empty(), warning);
        Ok(uvs)
    }

    fn normals(&mut self, mesh: &Mesh, primitive: &Primitive) -> Result<Vec<[f32; 3]>, Problem> {
        let mut normals = self.attribute::<3>(mesh, primitive, Semantic::Normals, "normal")?;
        let missing = normals.iter().filter(|&&normal| unit(normal).is_none()).count();
        if missing > 0 {
            self.warn(format!("{missing} of its normals are zero and were derived from its triangles"));
        }
        let derived = if missing > 0 { geometric_normals(mesh) } else { Vec::new() };
        for (vertex, normal) in normals.iter_mut().enumerate() {
            *normal = unit(*normal).unwrap_or_else(|| derived[vertex]);
        }
        Ok(normals)
    }

    fn tangents(&mut self, mesh: &Mesh, primitive: &Primitive) -> Result<Vec<[f32; 4]>, Problem> {
        let tangents = self.attribute::<4>(mesh, primitive, Semantic::Tangents, "tangent")?;
        let signed = |[x, y, z]: [f32; 3], sign: f32| [x, y, z, if sign < 0.0 { -1.0 } else { 1.0 }];
        let units = tangents.iter().map(|&[x, y, z, sign]| unit([x, y, z]).map(|unit| signed(unit, sign)));
        let units: Option<Vec<[f32; 4]>> = units.collect();
        self.warn_if(units.is_none(), "some of its tangents are zero; all are derived instead");
        Ok(units.unwrap_or_default())
    }

    /// An attribute of every vertex, finite and not too large; empty if the primitive has none.
    fn attribute<const N: usize>(
        &self,
        mesh: &Mesh,
        primitive: &Primitive,
        semantic: Semantic,
        what: &str,
    ) -> Result<Vec<[f32; N]>, Problem> {
        let Some(&accessor) = primitive.attributes.get(&Checked::Valid(semantic)) else {
            return Ok(Vec::new());
        };
        let values = self.document.vectors::<N>(accessor)?;
        let [vertices, found] = [mesh.positions.len(), values.len()];
        ensure!(found == vertices, "it has {vertices} vertices, and {what} for {found}");
        let is_good = |value: &[f32; N]| value.iter().all(|x| f64::from(*x).abs() <= MAX_COORDINATE);
        values.iter().position(|value| !is_good(value)).map_or(Ok(values), |vertex| {
            Err(format!("the {what} of vertex {vertex} is not finite within {MAX_COORDINATE:e}"))
        })
    }
}

/// The vector at length 1, unchanged if it has that up to rounding; none for zero.
fn unit(vector: [f32; 3]) -> Option<[f32; 3]> {
    let exact = double(vector);
    let length = exact.length();
    if (length - 1.0).abs() <= UNIT_TOLERANCE {
        return Some(vector);
    }
    (length > 0.0).then(|| (exact / length).as_vec3().to_array())
}

/// The mean normal of the triangles at each vertex, weighted by area; +z where there is none.
fn geometric_normals(mesh: &Mesh) -> Vec<[f32; 3]> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for (vertices, [a, b, c]) in mesh.indices.iter().zip(mesh.triangles()) {
        vertices.iter().for_each(|&vertex| sums[vertex as usize] += (b - a).cross(c - a));
    }
    sums.iter().map(|sum| sum.normalize_or(DVec3::Z).as_vec3().to_array()).collect()
}
