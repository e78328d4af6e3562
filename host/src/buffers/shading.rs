//! Shading records: normals, tangents and texture coordinates of the triangles' corners.

use super::lights::corner_uvs;
use super::triangles::{Triangle, is_mirrored};
use crate::scene::{Mesh, Scene, UvSet};
use glam::{DVec2, DVec3, Vec3};
use restir_shared::pack::encode_unit_vector;

/// Whether any mesh of the scene has what the records hold, or needs it.
pub(super) fn needs_shading(scene: &Scene) -> bool {
    let is_textured = |mesh: &Mesh| scene.materials[mesh.material].is_textured();
    let needs = |mesh: &Mesh| !mesh.normals.is_empty() || !mesh.uvs.is_empty() || is_textured(mesh);
    scene.instances.iter().map(|i| &scene.meshes[i.mesh]).any(|mesh| !mesh.indices.is_empty() && needs(mesh))
}

/// The record of a triangle, see [`restir_shared::layout`].
pub(super) fn record(scene: &Scene, triangle: Triangle) -> [[u32; 4]; 3] {
    let (instance, mesh) = (triangle.instance(scene), triangle.mesh(scene));
    let corners = triangle.corners(scene);
    let uvs = corner_uvs(scene, triangle, UvSet::First);
    let positions = triangle.vertices(scene).map(|v| v.as_dvec3());
    let geometric = (positions[1] - positions[0]).cross(positions[2] - positions[0]).normalize_or(DVec3::Z);
    let to_world = instance.transform.matrix3;
    let normal_to_world = to_world.inverse().transpose();
    let normals = corners.map(|i| {
        let own = mesh.normals.get(i).map(|n| normal_to_world * DVec3::from_array(n.map(f64::from)));
        own.map_or(geometric, |n| n.normalize_or(geometric))
    });
    let (tangents, sign) = match own_tangents(mesh, corners) {
        Some((tangents, sign)) => {
            (tangents.map(|t| (to_world * t).normalize_or(DVec3::X)), if is_mirrored(instance) { -sign } else { sign })
        }
        None => {
            let mapped = scene.materials[triangle.material(scene)].normal_texture;
            let uvs = corner_uvs(scene, triangle, mapped.map_or(UvSet::First, |used| used.uv_set));
            derived_tangent(positions, uvs, geometric)
        }
    };
    let normals = normals.map(packed);
    let tangents = tangents.map(|t| packed(t) & !1 | u32::from(sign < 0.0));
    let [[u0, v0], [u1, v1], [u2, v2]] = uvs.map(uv_bits);
    [[normals[0], normals[1], normals[2], tangents[0]], [tangents[1], tangents[2], u0, v0], [u1, v1, u2, v2]]
}

/// A triangle's second texture coordinates, see [`restir_shared::layout`].
pub(super) fn second_uvs(scene: &Scene, triangle: Triangle) -> [[u32; 4]; 2] {
    let [[u0, v0], [u1, v1], [u2, v2]] = corner_uvs(scene, triangle, UvSet::Second).map(uv_bits);
    [[u0, v0, u1, v1], [u2, v2, 0, 0]]
}

fn uv_bits(uv: DVec2) -> [u32; 2] {
    uv.as_vec2().to_array().map(f32::to_bits)
}

fn packed(v: DVec3) -> u32 {
    encode_unit_vector(Vec3::from_array(v.to_array().map(|x| x as f32)))
}

/// The tangents that the mesh brings, and the sign of its bitangents.
fn own_tangents(mesh: &Mesh, corners: [usize; 3]) -> Option<([DVec3; 3], f64)> {
    let [a, b, c] = corners.map(|i| mesh.tangents.get(i).copied());
    let (a, b, c) = (a?, b?, c?);
    Some(([a, b, c].map(|[x, y, z, _]| DVec3::new(f64::from(x), f64::from(y), f64::from(z))), f64::from(a[3])))
}

/// Along increasing u. A normal map's y points up in its image, against v.
fn derived_tangent(p: [DVec3; 3], uv: [DVec2; 3], normal: DVec3) -> ([DVec3; 3], f64) {
    let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
    let (d1, d2) = (uv[1] - uv[0], uv[2] - uv[0]);
    let orientation = d1.perp_dot(d2).signum();
    let along_u = (e1 * d2.y - e2 * d1.y) * orientation;
    let along_v = (e2 * d1.x - e1 * d2.x) * orientation;
    let tangent = along_u.normalize_or(normal.any_orthonormal_vector());
    ([tangent; 3], -normal.cross(tangent).dot(along_v).signum())
}
