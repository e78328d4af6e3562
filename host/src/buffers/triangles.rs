//! Triangles of all instances in world space.

use super::scene_error;
use crate::scene::{Instance, MAX_COORDINATE, Mesh, Scene};
use crate::{Error, bvh::Bounds, memory};
use glam::{DVec3, Vec3};
use restir_shared::vec::{cross, dot};
use restir_shared::{layout::MAX_TRIANGLES, num::flush};

/// The square of a triangle's doubled area below which it has no normal.
const MIN_AREA_SQUARED: f32 = restir_shared::num::FLUSH_BELOW;
/// Host memory that a triangle takes while the arenas are built: its flattened form, boxes, tree and records.
const BYTES_PER_TRIANGLE: u64 = 400;

/// A triangle of an instance. Everything else is looked up in the scene: a large one has millions of these.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    /// Its instance.
    pub(super) object: u32,
    /// Its index in the instance's mesh.
    index: u32,
}

impl Triangle {
    pub(super) fn instance(self, scene: &Scene) -> &Instance {
        &scene.instances[self.object as usize]
    }

    pub(super) fn mesh(self, scene: &Scene) -> &Mesh {
        &scene.meshes[self.instance(scene).mesh]
    }

    /// Its instance, and its index in the instance's mesh.
    pub(super) fn place(self) -> [u32; 2] {
        [self.object, self.index]
    }

    /// Index of its material.
    pub(super) fn material(self, scene: &Scene) -> usize {
        self.mesh(scene).material
    }

    /// The mesh's vertices at its corners, counter-clockwise from the front in the world.
    pub(super) fn corners(self, scene: &Scene) -> [usize; 3] {
        let [a, b, c] = self.mesh(scene).indices[self.index as usize];
        if is_mirrored(self.instance(scene)) { [a, c, b] } else { [a, b, c] }.map(|i| i as usize)
    }

    /// Its corners in world space; without an area they are one point, which no ray hits.
    pub(super) fn vertices(self, scene: &Scene) -> [Vec3; 3] {
        let (instance, mesh) = (self.instance(scene), self.mesh(scene));
        seen(self.corners(scene).map(|i| rounded(world_position(instance, mesh.positions[i]))))
    }
}

/// Whether the transform turns the mesh inside out, so that the second and third corner of its triangles are exchanged.
pub(super) fn is_mirrored(instance: &Instance) -> bool {
    instance.transform.matrix3.determinant() < 0.0
}

fn world_position(instance: &Instance, p: [f32; 3]) -> DVec3 {
    instance.transform.transform_point3(DVec3::from_array(p.map(f64::from)))
}

fn rounded(world: DVec3) -> Vec3 {
    Vec3::from_array(world.to_array().map(|x| flush(x as f32)))
}

/// Refuses what could not be held, before anything is made of it: a small file can place a large mesh many times.
fn check_count(scene: &Scene) -> Result<usize, Error> {
    let size = |instance: &Instance| scene.meshes.get(instance.mesh).map_or(0, |m| m.indices.len() as u64);
    let count: u64 = scene.instances.iter().map(size).sum();
    if count >= u64::from(MAX_TRIANGLES) {
        return Err(scene_error(scene, format!("has {count} triangles, more than the limit of {MAX_TRIANGLES}")));
    }
    memory::check(count * BYTES_PER_TRIANGLE, &format!("scene {}", scene.name), "choose a smaller scene")?;
    Ok(count as usize)
}

/// The triangles of all instances with their bounds in world space, and how many were skipped for want of area: none if the
/// scene moves, which may give them one.
pub(super) fn flatten(scene: &Scene, moves: bool) -> Result<(Vec<Triangle>, Vec<Bounds>, u64), Error> {
    let count = check_count(scene)?;
    let (mut triangles, mut bounds) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let mut skipped = 0;
    let broken = |problem: String| Err(scene_error(scene, problem));
    for (object, instance) in scene.instances.iter().enumerate() {
        let Some(mesh) = scene.meshes.get(instance.mesh) else {
            return broken(format!("instance {object} refers to mesh {}, which does not exist", instance.mesh));
        };
        let Mesh { name, material, .. } = mesh.as_ref();
        if *material >= scene.materials.len() {
            return broken(format!("mesh {name:?} refers to material {material}, which does not exist"));
        }
        let positions = world_positions(scene, instance.mesh, object)?;
        let flipped = is_mirrored(instance);
        for (index, corner) in mesh.indices.iter().enumerate() {
            let [a, b, c] = corner.map(|i| positions.get(i as usize).copied());
            let (Some(a), Some(b), Some(c)) = (a, b, c) else {
                return broken(format!("mesh {name:?}: triangle {index} refers to a vertex that does not exist"));
            };
            let corners = if flipped { [a, c, b] } else { [a, b, c] };
            if moves || has_normal(&corners) {
                triangles.push(Triangle { object: object as u32, index: index as u32 });
                bounds.push(Bounds::of(&seen(corners)));
            } else {
                skipped += 1;
            }
        }
    }
    if triangles.is_empty() {
        return broken(format!("has no triangle with an area ({skipped} without one were skipped)"));
    }
    Ok((triangles, bounds, skipped))
}

/// Refuses triangles of objects that have moved too far away.
pub(super) fn check_moved(scene: &Scene, triangles: &[Triangle], moved: &[bool]) -> Result<(), Error> {
    let is_near = |triangle: &Triangle| {
        triangle.vertices(scene).iter().all(|v| v.is_finite() && f64::from(v.abs().max_element()) <= MAX_COORDINATE)
    };
    let far = triangles.iter().find(|triangle| moved[triangle.object as usize] && !is_near(triangle));
    far.map_or(Ok(()), |far| {
        let name = &far.mesh(scene).name;
        Err(scene_error(scene, format!("mesh {name:?} moves beyond 1.07e9; correct its motion")))
    })
}

fn world_positions(scene: &Scene, mesh: usize, object: usize) -> Result<Vec<Vec3>, Error> {
    let instance = &scene.instances[object];
    let mesh = &scene.meshes[mesh];
    let place = |(index, p): (usize, &[f32; 3])| {
        let world = world_position(instance, *p);
        if world.is_finite() && world.abs().max_element() <= MAX_COORDINATE {
            Ok(rounded(world))
        } else {
            let vertex = format!("mesh {:?}: vertex {index} at {world}", mesh.name);
            let problem = "is not a finite position within 1.07e9; correct or scale the mesh";
            Err(scene_error(scene, format!("{vertex} {problem}")))
        }
    };
    mesh.positions.iter().enumerate().map(place).collect()
}

/// Whether the kernels' own arithmetic finds a normal: slivers whose cross product cancels have none.
fn has_normal(&[a, b, c]: &[Vec3; 3]) -> bool {
    let normal = cross(b - a, c - a);
    dot(normal, normal) >= MIN_AREA_SQUARED
}

/// A triangle as rays find it: one without an area is a point.
fn seen(vertices: [Vec3; 3]) -> [Vec3; 3] {
    if has_normal(&vertices) { vertices } else { [vertices[0]; 3] }
}

/// The area of a triangle.
pub(super) fn area([a, b, c]: &[Vec3; 3]) -> f64 {
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}
