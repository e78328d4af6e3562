//! Bodies that touch. Who leaves one is in what is around it until it meets another front. Where two faces lie in each other a
//! ray that begins beside the first has passed the second already, and light goes through the second body as if nothing filled it. So the host says
//! which bodies touch.
//!
//! ```
//! use restir_host::scene::{Material, Mesh, Scene, subsurface::medium};
//! use restir_shared::glam::DVec3;
//!
//! let mut scene = Scene::default();
//! let milk = Material { volume: Some(medium("milk", 0.01)?), ..Material::diffuse("milk", [1.0; 3]) };
//! let milk = scene.add_material(milk);
//! scene.add_mesh("left", milk, Mesh::cuboid(DVec3::ZERO, DVec3::ONE));
//! scene.add_mesh("right", milk, Mesh::cuboid(DVec3::X, DVec3::new(2.0, 0.5, 1.0)));
//! scene.add_mesh("apart", milk, Mesh::cuboid(DVec3::new(2.001, 0.0, 0.0), DVec3::new(3.0, 0.5, 1.0)));
//! assert_eq!(scene.touching_bodies(), [["left".to_owned(), "right".to_owned()]]);
//! # Ok::<(), restir_host::Error>(())
//! ```

use std::collections::HashMap;

use glam::DVec3;

use super::{Instance, Scene};

/// Faces that are nearer to each other than this part of the largest coordinate touch: rays begin about as far beside a surface.
const NEAR: f64 = 1.0 / 65_536.0;
/// Steps of a normal's components by which faces are looked up.
const STEPS: f64 = 256.0;

/// A triangle in the world.
struct Face {
    normal: DVec3,
    /// Of its plane, along the normal.
    offset: f64,
    lo: DVec3,
    hi: DVec3,
}

/// An instance that is filled.
struct Body {
    name: String,
    faces: Vec<Face>,
    lo: DVec3,
    hi: DVec3,
}

impl Face {
    fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Self { normal, offset: normal.dot(a), lo: a.min(b).min(c), hi: a.max(b).max(c) }
    }

    fn key(normal: DVec3) -> [i32; 3] {
        (normal * STEPS).to_array().map(|x| x.round() as i32)
    }

    /// Whether they share more than a line: of their bounds, not of themselves.
    fn meets(&self, other: &Self, near: f64) -> bool {
        let common = (self.hi.min(other.hi) - self.lo.max(other.lo)).to_array();
        common.iter().all(|x| *x > -near) && common.iter().filter(|x| **x > near).count() >= 2
    }
}

impl Body {
    fn new(scene: &Scene, instance: &Instance) -> Self {
        let mesh = &scene.meshes[instance.mesh];
        let placed = |corner| instance.transform.transform_point3(corner);
        let faces: Vec<Face> = mesh.triangles().map(|corners| Face::new(corners.map(placed))).collect();
        let fold = |of: fn(DVec3, DVec3) -> DVec3, side: fn(&Face) -> DVec3| faces.iter().map(side).reduce(of);
        let (lo, hi) = (fold(DVec3::min, |face| face.lo), fold(DVec3::max, |face| face.hi));
        Self { name: mesh.name.clone(), lo: lo.unwrap_or_default(), hi: hi.unwrap_or_default(), faces }
    }

    /// Faces that reach into the bounds of the other.
    fn beside<'a>(&'a self, other: &'a Self, near: f64) -> impl Iterator<Item = &'a Face> {
        let within =
            move |face: &&Face| (face.lo - near).cmple(other.hi).all() && (other.lo - near).cmple(face.hi).all();
        self.faces.iter().filter(within)
    }

    fn touches(&self, other: &Self) -> bool {
        let reach = [self.lo, self.hi, other.lo, other.hi].map(|corner| corner.abs().max_element());
        let near = NEAR * reach.into_iter().fold(0.0, f64::max);
        if (self.lo - near).cmpgt(other.hi).any() || (other.lo - near).cmpgt(self.hi).any() {
            return false;
        }
        let mut planes: HashMap<[i32; 3], Vec<&Face>> = HashMap::new();
        for face in other.beside(self, near) {
            planes.entry(Face::key(-face.normal)).or_default().push(face);
        }
        planes.values_mut().for_each(|faces| faces.sort_by(|a, b| a.offset.total_cmp(&b.offset)));
        self.beside(other, near).any(|face| {
            let facing = planes.get(&Face::key(face.normal)).map_or(&[][..], Vec::as_slice);
            let first = facing.partition_point(|of| of.offset < -face.offset - near);
            let in_plane = facing[first..].iter().take_while(|of| of.offset <= -face.offset + near);
            in_plane.into_iter().any(|of| face.meets(of, near))
        })
    }
}

impl Scene {
    /// Pairs of bodies whose interiors scatter light and of which a face of one lies in a face of the other, back to back, by the names of their meshes.
    #[doc(hidden)]
    pub fn touching_bodies(&self) -> Vec<[String; 2]> {
        let scatters = |instance: &&Instance| {
            let material = &self.materials[self.meshes[instance.mesh].material];
            material.volume.is_some_and(|volume| volume.scattering.is_some())
        };
        let bodies: Vec<Body> =
            self.instances.iter().filter(scatters).map(|instance| Body::new(self, instance)).collect();
        let mut pairs = Vec::new();
        for (i, body) in bodies.iter().enumerate() {
            let others = bodies[i + 1..].iter().filter(|other| body.touches(other));
            pairs.extend(others.map(|other| [body.name.clone(), other.name.clone()]));
        }
        pairs
    }

    /// Says of bodies that touch what becomes of light between them.
    #[doc(hidden)]
    pub fn warn_of_touching_bodies(&mut self) {
        let warning = |[a, b]: [String; 2]| {
            format!(
                "the bodies {a:?} and {b:?} touch: light that goes from one to the other where their faces meet may pass the second as if it was empty; leave a gap"
            )
        };
        let warnings: Vec<String> = self.touching_bodies().into_iter().map(warning).collect();
        self.warnings.extend(warnings);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Mesh, builtin, subsurface};

    fn touching(other: Mesh) -> bool {
        let mut scene = Scene::default();
        let milk = subsurface::medium("milk", 0.01).expect("a medium");
        let milk = scene.add_material(Material { volume: Some(milk), ..Material::diffuse("milk", [1.0; 3]) });
        scene.add_mesh("one", milk, Mesh::cuboid(DVec3::ZERO, DVec3::ONE));
        scene.add_mesh("other", milk, other);
        let touches = !scene.touching_bodies().is_empty();
        scene.warn_of_touching_bodies();
        assert_eq!(scene.warnings.len(), usize::from(touches));
        touches
    }

    #[test]
    fn faces_that_lie_in_each_other_touch_and_edges_do_not() {
        let beside = |x: f64, y: f64| Mesh::cuboid(DVec3::new(x, y, 0.2), DVec3::new(x + 1.0, y + 1.0, 0.7));
        assert!(touching(beside(1.0, 0.0)) && touching(beside(1.0, 0.9)) && touching(beside(1.0 + 1.0e-6, -0.5)));
        assert!(!touching(beside(1.001, 0.0)) && !touching(beside(1.0, 1.0)) && !touching(beside(3.0, 0.0)));
        // one inside of the other, whose faces look the same way, is another matter
        assert!(!touching(Mesh::cuboid(DVec3::splat(0.25), DVec3::splat(0.75))));
        assert!(!touching(Mesh::sphere(DVec3::new(2.0, 0.5, 0.5), 1.0, 4)));
        for name in ["candles", "cube", "slab", "statue"] {
            assert_eq!(builtin::scene(name).expect("built in").touching_bodies(), [[""; 2]; 0], "{name}");
        }
    }
}
