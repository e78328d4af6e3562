//! Triangles of all instances in world space.

use super::scene_error;
use crate::scene::{Instance, MAX_COORDINATE, Scene};
use crate::{Error, memory};
use glam::{DVec3, Vec3};
use restir_shared::layout::MAX_TRIANGLES;
use restir_shared::num::flush;
use restir_shared::vec::{cross, dot};

/// The square of a triangle's doubled area below which it has no normal.
const MIN_AREA_SQUARED: f32 = restir_shared::num::FLUSH_BELOW;
/// Host memory that a triangle takes while the arenas are built: its flattened form, boxes, tree and records.
const BYTES_PER_TRIANGLE: u64 = 400;

/// A triangle in world space.
pub(super) struct Triangle {
    /// Counter-clockwise from the front.
    pub(super) vertices: [Vec3; 3],
    pub(super) material: u32,
    /// Its instance.
    pub(super) object: u32,
    /// Its index in the instance's mesh.
    pub(super) index: u32,
}

/// Whether the transform turns the mesh inside out, so that the second and third corner of its triangles are exchanged.
pub(super) fn is_mirrored(instance: &Instance) -> bool {
    instance.transform.matrix3.determinant() < 0.0
}

/// Refuses what could not be held, before anything is made of it: a small file can place a large mesh many times.
fn check_count(scene: &Scene) -> Result<(), Error> {
    let size =
        |instance: &crate::scene::Instance| scene.meshes.get(instance.mesh).map_or(0, |m| m.indices.len() as u64);
    let count: u64 = scene.instances.iter().map(size).sum();
    if count >= u64::from(MAX_TRIANGLES) {
        return Err(scene_error(scene, format!("has {count} triangles, more than the limit of {MAX_TRIANGLES}")));
    }
    memory::check(count * BYTES_PER_TRIANGLE, &format!("scene {}", scene.name), "choose a smaller scene")
}

/// The triangles of all instances in world space, and how many were skipped for want of area.
pub(super) fn flatten(scene: &Scene) -> Result<(Vec<Triangle>, u64), Error> {
    check_count(scene)?;
    let mut triangles = Vec::new();
    let mut skipped = 0;
    for (object, instance) in scene.instances.iter().enumerate() {
        let Some(mesh) = scene.meshes.get(instance.mesh) else {
            return Err(scene_error(
                scene,
                format!("instance {object} refers to mesh {}, which does not exist", instance.mesh),
            ));
        };
        if mesh.material >= scene.materials.len() {
            return Err(scene_error(
                scene,
                format!("mesh {:?} refers to material {}, which does not exist", mesh.name, mesh.material),
            ));
        }
        let positions = world_positions(scene, instance.mesh, object)?;
        let flipped = is_mirrored(instance);
        for (index, corner) in mesh.indices.iter().enumerate() {
            let [a, b, c] = corner.map(|i| positions.get(i as usize).copied());
            let (Some(a), Some(b), Some(c)) = (a, b, c) else {
                return Err(scene_error(
                    scene,
                    format!("mesh {:?}: triangle {index} refers to a vertex that does not exist", mesh.name),
                ));
            };
            let vertices = if flipped { [a, c, b] } else { [a, b, c] };
            if !has_normal(&vertices) {
                skipped += 1;
            } else {
                triangles.push(Triangle {
                    vertices,
                    material: mesh.material as u32,
                    object: object as u32,
                    index: index as u32,
                });
            }
        }
    }
    if triangles.is_empty() {
        return Err(scene_error(scene, format!("has no triangle with an area ({skipped} without one were skipped)")));
    }
    Ok((triangles, skipped))
}

fn world_positions(scene: &Scene, mesh: usize, object: usize) -> Result<Vec<Vec3>, Error> {
    let transform = scene.instances[object].transform;
    let mesh = &scene.meshes[mesh];
    let place = |(index, p): (usize, &[f32; 3])| {
        let world = transform.transform_point3(DVec3::from_array(p.map(f64::from)));
        if world.abs().max_element() <= MAX_COORDINATE {
            Ok(Vec3::from_array(world.to_array().map(|x| flush(x as f32))))
        } else {
            let problem = format!(
                "mesh {:?}: vertex {index} at {world} is not a finite position within 1.07e9; correct or scale the mesh",
                mesh.name
            );
            Err(scene_error(scene, problem))
        }
    };
    mesh.positions.iter().enumerate().map(place).collect()
}

/// Whether the kernels' own arithmetic finds a normal: slivers whose cross product cancels have none.
fn has_normal(&[a, b, c]: &[Vec3; 3]) -> bool {
    let normal = cross(b - a, c - a);
    dot(normal, normal) >= MIN_AREA_SQUARED
}

/// The area of a triangle.
pub(super) fn area([a, b, c]: &[Vec3; 3]) -> f64 {
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}
