//! Bodies within bodies. A path has no stack of bodies, so what is around each is found beforehand: which body encloses it, of those that do the
//! smallest. From there a path knows where it is when it leaves the inner one, and the index of refraction of the inner one is relative
//! to that of the outer one. Both are stored with materials, so that bodies of one material have to lie in the same.
//!
//! ```
//! use restir_host::scene::{Material, Mesh, Scene, subsurface::medium};
//! use restir_shared::glam::DVec3;
//!
//! let mut scene = Scene::default();
//! let wax = Material { volume: Some(medium("wax", 0.01)?), ..Material::diffuse("wax", [1.0; 3]) };
//! let wax = scene.add_material(wax);
//! let jade = Material { volume: Some(medium("marble", 0.01)?), ..Material::diffuse("jade", [1.0; 3]) };
//! let jade = scene.add_material(jade);
//! scene.add_mesh("lump", wax, Mesh::sphere(DVec3::ZERO, 1.0, 3));
//! scene.add_mesh("bead", jade, Mesh::sphere(DVec3::X * 0.5, 0.2, 2));
//! assert_eq!(scene.surroundings(), [None, Some(0)]);
//! # Ok::<(), restir_host::Error>(())
//! ```

use std::collections::BTreeMap;

use glam::DVec3;

use super::{Material, Scene};

/// Where rays go that ask what is inside: along no axis and no diagonal.
const AWAY: DVec3 = DVec3::new(0.537_1, 0.781_3, 0.318_9);
/// How many triangles of a body have to begin inside of another one.
const WITNESSES: usize = 4;

/// The instances of an object that is filled.
struct Body {
    material: usize,
    instances: Vec<usize>,
    lo: DVec3,
    hi: DVec3,
    /// Corners of some of its triangles.
    witnesses: Vec<DVec3>,
}

/// How a body lies to another one.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Inside,
    Outside,
    Across,
}

impl Body {
    fn new(scene: &Scene, material: usize, instances: Vec<usize>) -> Self {
        let body = Self { material, instances, lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY, witnesses: Vec::new() };
        let corners = || body.triangles(scene).flatten();
        let (lo, hi) = (corners().fold(body.lo, DVec3::min), corners().fold(body.hi, DVec3::max));
        let step = body.triangles(scene).count().div_ceil(WITNESSES).max(1);
        let witnesses = body.triangles(scene).step_by(step).map(|[corner, ..]| corner).collect();
        Self { lo, hi, witnesses, ..body }
    }

    fn triangles<'a>(&'a self, scene: &'a Scene) -> impl Iterator<Item = [DVec3; 3]> + 'a {
        self.instances.iter().flat_map(move |&index| {
            let instance = scene.instances[index];
            let placed = move |corner| instance.transform.transform_point3(corner);
            scene.meshes[instance.mesh].triangles().map(move |corners| corners.map(placed))
        })
    }

    /// Whether a ray from the point crosses the surface an odd number of times.
    fn holds(&self, scene: &Scene, point: DVec3) -> bool {
        self.triangles(scene).filter(|corners| crosses(point, corners)).count() % 2 == 1
    }

    fn volume(&self) -> f64 {
        (self.hi - self.lo).element_product()
    }

    fn place(&self, scene: &Scene, other: &Self) -> Place {
        if self.lo.cmpgt(other.hi).any() || other.lo.cmpgt(self.hi).any() {
            return Place::Outside;
        }
        let held = self.witnesses.iter().filter(|&&corner| other.holds(scene, corner)).count();
        let within = other.lo.cmple(self.lo).all() && self.hi.cmple(other.hi).all();
        match held {
            0 => Place::Outside,
            all if within && all == self.witnesses.len() => Place::Inside,
            _ => Place::Across,
        }
    }
}

/// Whether a ray from the point crosses a triangle (Möller and Trumbore 1997).
fn crosses(point: DVec3, [a, b, c]: &[DVec3; 3]) -> bool {
    let (e1, e2, from) = (b - a, c - a, point - a);
    let (p, q) = (AWAY.cross(e2), from.cross(e1));
    let scale = 1.0 / e1.dot(p);
    let (u, v) = (from.dot(p) * scale, AWAY.dot(q) * scale);
    u >= 0.0 && v >= 0.0 && u + v < 1.0 && e2.dot(q) * scale > 0.0
}

impl Scene {
    /// Of each material, the first instance of the innermost body that encloses all bodies of it; none if they lie in none, or in different ones.
    ///
    /// # Panics
    /// If an instance has no mesh, or a mesh no material, as [`crate::buffers::SceneBuffers::build`] refuses them.
    #[doc(hidden)]
    pub fn surroundings(&self) -> Vec<Option<usize>> {
        self.nested(&self.bodies()).into_iter().map(|found| found.flatten()).collect()
    }

    /// The scene as a path meets it: the indices of refraction of bodies in other ones are relative to these.
    pub(crate) fn relative_to(&self, surroundings: &[Option<usize>]) -> Self {
        let mut scene = self.clone();
        for (material, around) in scene.materials.iter_mut().zip(surroundings) {
            // coats know no index below 1, which a rarer body would need: `warn_of_nested_bodies` says what becomes of it
            material.ior = (material.ior / around.map_or(1.0, |instance| self.index_inside(instance))).max(1.0);
        }
        scene
    }

    /// Says of bodies in other ones what is not rendered as it is.
    #[doc(hidden)]
    pub fn warn_of_nested_bodies(&mut self) {
        let bodies = self.bodies();
        let mut warnings = Vec::new();
        for (material, around) in self.nested(&bodies).into_iter().enumerate() {
            let Material { name, ior, .. } = &self.materials[material];
            match around {
                None => warnings.push(format!(
                    "bodies of the material {name:?} lie in different ones: light that leaves them is taken to be outside of all; give each its own material"
                )),
                Some(Some(instance)) if self.index_inside(instance) > *ior => warnings.push(format!(
                    "bodies of the material {name:?} lie in one of a larger index of refraction: their surface is rendered as if the indices were equal; \
                     model them as holes of the outer body"
                )),
                Some(_) => {}
            }
        }
        for (i, body) in bodies.iter().enumerate() {
            let across = bodies[i + 1..]
                .iter()
                .filter(|other| [body.place(self, other), other.place(self, body)].contains(&Place::Across));
            warnings.extend(across.map(|other| {
                let name = |body: &Body| &self.meshes[self.instances[body.instances[0]].mesh].name;
                format!(
                    "the bodies {:?} and {:?} overlap: what they have in common is filled by the one that light enters last; let one enclose the other, or leave a gap",
                    name(body),
                    name(other)
                )
            }));
        }
        self.warnings.extend(warnings);
    }

    /// The bodies, if there are two at least, or none can lie in another.
    fn bodies(&self) -> Vec<Body> {
        let material = |index: usize| self.meshes[self.instances[index].mesh].material;
        let is_filled = |index: &usize| self.materials[material(*index)].volume.is_some();
        let filled: Vec<usize> = (0..self.instances.len()).filter(is_filled).collect();
        if filled.len() < 2 {
            return Vec::new();
        }
        let (objects, mut parts) = (self.objects(), BTreeMap::<u32, Vec<usize>>::new());
        for index in filled {
            parts.entry(objects[index]).or_default().push(index);
        }
        parts.into_values().map(|instances| Body::new(self, material(instances[0]), instances)).collect()
    }

    /// Of each material, what encloses its bodies, if it is the same for all.
    fn nested(&self, bodies: &[Body]) -> Vec<Option<Option<usize>>> {
        let mut around = vec![Some(None); self.materials.len()];
        let mut known = vec![false; self.materials.len()];
        for body in bodies {
            let others = bodies.iter().filter(|other| other.volume() > body.volume());
            let enclosing = others.filter(|other| body.place(self, other) == Place::Inside);
            let innermost = enclosing.min_by(|a, b| a.volume().total_cmp(&b.volume())).map(|other| other.instances[0]);
            let differs = known[body.material] && around[body.material] != Some(innermost);
            around[body.material] = if differs { None } else { Some(innermost) };
            known[body.material] = true;
        }
        around
    }

    /// The index of refraction of what fills an instance: 1 where light does not enter by refraction.
    fn index_inside(&self, instance: usize) -> f32 {
        let material = &self.materials[self.meshes[self.instances[instance].mesh].material];
        if material.transmission > 0.0 { material.ior } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, Volume, builtin};

    /// Cubes around the origin of these half sides, each of a material of its own and of this index of refraction.
    fn cubes(of: &[(f64, f32)]) -> Scene {
        let mut scene = Scene::default();
        for &(half, ior) in of {
            let volume = Some(Volume::absorbing([1.0; 3], 1.0));
            let glass = Material { transmission: 1.0, ior, volume, ..Material::diffuse(format!("{half}"), [1.0; 3]) };
            let glass = scene.add_material(glass);
            scene.add_mesh(&format!("{half}"), glass, Mesh::cuboid(DVec3::splat(-half), DVec3::splat(half)));
        }
        scene
    }

    fn warnings(scene: &Scene) -> Vec<String> {
        let mut scene = scene.clone();
        scene.warn_of_nested_bodies();
        scene.warnings
    }

    #[test]
    fn the_innermost_body_is_around() {
        let scene = cubes(&[(0.2, 1.6), (3.0, 1.2), (1.0, 1.5)]);
        assert_eq!(scene.surroundings(), [Some(2), None, Some(1)]);
        let relative = scene.relative_to(&scene.surroundings());
        assert_eq!(relative.materials.iter().map(|m| m.ior).collect::<Vec<_>>(), [1.6 / 1.5, 1.2, 1.5 / 1.2]);
        assert!(warnings(&scene).is_empty());
        // light enters wax by other laws than those of refraction
        let mut wax = scene;
        wax.materials[2] = Material { transmission: 0.0, diffuse_transmission: 1.0, ..wax.materials[2].clone() };
        assert_eq!(wax.relative_to(&wax.surroundings()).materials[0].ior, 1.6);
    }

    #[test]
    fn what_is_not_rendered_as_it_is_is_said() {
        let rarer = cubes(&[(1.0, 1.5), (0.5, 1.2)]);
        assert_eq!(rarer.relative_to(&rarer.surroundings()).materials[1].ior, 1.0);
        assert!(warnings(&rarer)[0].contains("\"0.5\" lie in one of a larger index"));
        let mut apart = cubes(&[(1.0, 1.5), (0.5, 1.5)]);
        apart.add_mesh("other", 1, Mesh::cuboid(DVec3::splat(8.0), DVec3::splat(9.0)));
        assert_eq!(apart.surroundings(), [None, None]);
        assert!(warnings(&apart)[0].contains("\"0.5\" lie in different ones"));
        let mut across = cubes(&[(1.0, 1.5)]);
        across.add_mesh("cuts", 0, Mesh::cuboid(DVec3::splat(0.5), DVec3::splat(1.5)));
        assert_eq!(across.surroundings(), [None]);
        assert!(warnings(&across)[0].contains("\"1\" and \"cuts\" overlap"));
    }

    #[test]
    fn bodies_of_built_in_scenes_lie_in_no_other() {
        for (name, _) in builtin::NAMES {
            let scene = builtin::scene(name).expect("built in").at(0.0);
            assert!(scene.surroundings().iter().all(Option::is_none) && warnings(&scene).is_empty(), "{name}");
        }
    }
}
