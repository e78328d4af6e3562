//! Vertices under morph targets and skins.

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

use super::{Deformation, MorphTarget, Skinning};
use crate::scene::{Mesh, double};

impl Deformation {
    /// The mesh with `weights` for the targets, and then `joints`, which are those of the skin, from the space of the
    /// mesh at rest to the world. Sums are those of double precision; results are rounded once.
    pub(super) fn apply(&self, rest: &Mesh, weights: &[f64], joints: Option<&[DAffine3]>) -> Mesh {
        let weighted = self.targets.iter().zip(weights.iter().copied());
        let active: Vec<(&MorphTarget, f64)> = weighted.filter(|(_, weight)| *weight != 0.0).collect();
        let skin = self.skinning.as_ref().zip(joints);
        let map = |vertex: usize| skin.map_or(DAffine3::IDENTITY, |(skinning, joints)| skinning.map(vertex, joints));
        let morphed = |value: DVec3, vertex: usize, of: fn(&MorphTarget) -> &[[f32; 3]]| {
            let add = |sum, &(target, weight): &(&MorphTarget, f64)| {
                of(target).get(vertex).map_or(sum, |delta| sum + double(*delta) * weight)
            };
            active.iter().fold(value, add)
        };
        let position = |(vertex, p): (usize, &[f32; 3])| {
            let p = morphed(double(*p), vertex, |target| &target.positions);
            map(vertex).transform_point3(p).as_vec3().to_array()
        };
        let normal = |(vertex, n): (usize, &[f32; 3])| {
            let moved = cofactors(&map(vertex).matrix3) * morphed(double(*n), vertex, |target| &target.normals);
            moved.normalize_or(double(*n)).as_vec3().to_array()
        };
        let tangent = |(vertex, &[x, y, z, sign]): (usize, &[f32; 4])| {
            let own = double([x, y, z]);
            let moved = map(vertex).transform_vector3(morphed(own, vertex, |target| &target.tangents));
            let [x, y, z] = moved.normalize_or(own).as_vec3().to_array();
            [x, y, z, sign]
        };
        Mesh {
            name: rest.name.clone(),
            positions: rest.positions.par_iter().enumerate().map(position).collect(),
            normals: rest.normals.par_iter().enumerate().map(normal).collect(),
            uvs: rest.uvs.clone(),
            second_uvs: rest.second_uvs.clone(),
            tangents: rest.tangents.par_iter().enumerate().map(tangent).collect(),
            indices: rest.indices.clone(),
            material: rest.material,
        }
    }
}

impl Skinning {
    /// The mean of a vertex's joints, by their weights.
    fn map(&self, vertex: usize, joints: &[DAffine3]) -> DAffine3 {
        let (mut matrix, mut translation, mut sum) = (DMat3::ZERO, DVec3::ZERO, 0.0);
        for set in &self.sets {
            let (Some(indices), Some(weights)) = (set.joints.get(vertex), set.weights.get(vertex)) else { continue };
            for (&index, weight) in indices.iter().zip(weights.map(f64::from)).filter(|(_, weight)| *weight > 0.0) {
                let joint = joints.get(usize::from(index)).copied().unwrap_or_default();
                matrix += joint.matrix3 * weight;
                translation += joint.translation * weight;
                sum += weight;
            }
        }
        if sum > 0.0 {
            DAffine3::from_mat3_translation(matrix * sum.recip(), translation * sum.recip())
        } else {
            DAffine3::IDENTITY
        }
    }
}

/// What maps the cross product of two vectors to that of their images: normals stay perpendicular to their surface, on its
/// side, also where the map flattens it. It is the inverse transpose times the determinant.
fn cofactors(matrix: &DMat3) -> DMat3 {
    let (x, y, z) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}
