//! Shapes as meshes, lights made of them, and subdivision.

use std::collections::{BTreeSet, HashMap};

use glam::{DAffine3, DVec3};

use super::{Instance, Material, Mesh, Scene, double};

/// Subdivisions of the icosahedron that is a sphere light: 1280 triangles. With an area equal to the sphere's, its
/// surface lies within 0.4 % of the radius of the sphere's.
const SPHERE_LIGHT_LEVEL: u32 = 3;

impl Mesh {
    /// A parallelogram: `corner` and the two edges that leave it. The front is the side of `edges[0] x edges[1]`;
    /// texture coordinates run from 0 to 1 along the edges.
    pub fn quad(corner: DVec3, edges: [DVec3; 2]) -> Mesh {
        let [u, v] = edges;
        Mesh {
            positions: [corner, corner + u, corner + u + v, corner + v].map(|p| p.as_vec3().to_array()).to_vec(),
            uvs: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
            indices: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }
    }

    /// A closed box with its faces along the axes, front sides out; texture coordinates run from 0 to 1 on each face.
    pub fn cuboid(lo: DVec3, hi: DVec3) -> Mesh {
        let [x, y, z] = DVec3::AXES.map(|axis| axis * (hi - lo));
        let faces = [(lo, [y, x]), (lo, [z, y]), (lo, [x, z]), (hi, [-x, -y]), (hi, [-y, -z]), (hi, [-z, -x])];
        Mesh::union(&faces.map(|(corner, edges)| Mesh::quad(corner, edges)))
    }

    /// A sphere with smooth normals and no texture coordinates: an icosahedron whose triangles are split `level` times
    /// in four, `20 * 4^level` triangles in all. It is as large as makes its area that of the sphere, so that a light of
    /// this shape has the sphere's power.
    pub fn sphere(centre: DVec3, radius: f64, level: u32) -> Mesh {
        let mut mesh = icosahedron();
        for _ in 0..level {
            mesh = mesh.split();
            mesh.positions.iter_mut().for_each(|p| *p = double(*p).normalize().as_vec3().to_array());
        }
        let scale = radius * (4.0 * std::f64::consts::PI / mesh.area()).sqrt();
        mesh.normals = mesh.positions.clone();
        let place = |p: &[f32; 3]| (centre + double(*p) * scale).as_vec3().to_array();
        mesh.positions = mesh.positions.iter().map(place).collect();
        mesh
    }

    /// The surface that a curve in the plane sweeps in a turn about the y axis, in `segments` steps, with smooth normals
    /// and no texture coordinates.
    ///
    /// `profile` has (distance from the axis, height); the front is to the right of the way along it, so that a profile
    /// upwards faces out. The surface is closed if its ends lie on the axis. A point that occurs twice in a row is an
    /// edge; elsewhere normals are smooth along the profile too.
    pub fn lathe(profile: &[[f64; 2]], segments: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for (i, &[radius, height]) in profile.iter().enumerate() {
            let [out, up] = profile_normal(profile, i);
            for k in 0..segments {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(segments)).sin_cos();
                let around = |r: f64, y: f64| DVec3::new(r * cos, y, r * sin).as_vec3().to_array();
                mesh.positions.push(around(radius, height));
                mesh.normals.push(around(out, up));
            }
        }
        for ring in (1..profile.len()).filter(|&ring| profile[ring - 1] != profile[ring]) {
            for k in 0..segments {
                // on the axis a ring is one point
                let at = |ring: usize, k: u32| {
                    ring as u32 * segments + if profile[ring][0] == 0.0 { 0 } else { k % segments }
                };
                let [a, b, c, d] = [at(ring - 1, k), at(ring - 1, k + 1), at(ring, k), at(ring, k + 1)];
                mesh.indices.extend([[a, c, d], [a, d, b]].iter().filter(|[i, j, k]| j != k && k != i));
            }
        }
        mesh
    }

    /// All of `parts` as one mesh of the first one's name and material. Normals, texture coordinates and tangents are
    /// those of the parts if each has them.
    pub fn union(parts: &[Mesh]) -> Mesh {
        let mut union = parts.first().cloned().unwrap_or_default();
        for part in parts.iter().skip(1) {
            let offset = union.positions.len() as u32;
            union.positions.extend(&part.positions);
            union.indices.extend(part.indices.iter().map(|triangle| triangle.map(|i| i + offset)));
            union.normals.extend(&part.normals);
            union.uvs.extend(&part.uvs);
            union.second_uvs.extend(&part.second_uvs);
            union.tangents.extend(&part.tangents);
        }
        let vertices = union.positions.len();
        let complete = |count: usize| if count == vertices { count } else { 0 };
        union.normals.truncate(complete(union.normals.len()));
        union.uvs.truncate(complete(union.uvs.len()));
        union.second_uvs.truncate(complete(union.second_uvs.len()));
        union.tangents.truncate(complete(union.tangents.len()));
        union
    }

    /// Sum of the triangles' areas in the mesh's own space.
    pub fn area(&self) -> f64 {
        0.5 * self.triangles().map(|[a, b, c]| (b - a).cross(c - a).length()).sum::<f64>()
    }

    /// The corners of each triangle in the mesh's own space.
    pub fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.indices.iter().map(|triangle| triangle.map(|i| double(self.positions[i as usize])))
    }

    /// Whether each edge is shared by exactly two triangles that run along it in opposite directions.
    #[cfg(test)]
    pub(super) fn is_closed(&self) -> bool {
        let mut edges = HashMap::new();
        for [i, j] in self.indices.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]) {
            *edges.entry([i, j]).or_insert(0) += 1;
        }
        edges.iter().all(|(&[i, j], &count)| count == 1 && edges.get(&[j, i]) == Some(&1))
    }

    /// The same surface with each triangle in four. Neighbours share the new vertices, so that what was closed stays so.
    fn split(&self) -> Mesh {
        let mut split = self.clone();
        let mut middles = HashMap::new();
        split.indices = Vec::with_capacity(4 * self.indices.len());
        for &[a, b, c] in &self.indices {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[i, j]| {
                *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| split.add_middle(i.min(j), i.max(j)))
            });
            split.indices.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        split
    }

    /// Appends the vertex half-way between two others.
    fn add_middle(&mut self, i: u32, j: u32) -> u32 {
        let (i, j) = (i as usize, j as usize);
        let middle = self.positions.len() as u32;
        self.positions.push((0.5 * (double(self.positions[i]) + double(self.positions[j]))).as_vec3().to_array());
        if !self.normals.is_empty() {
            self.normals.push(bisector(double(self.normals[i]), double(self.normals[j])));
        }
        for uvs in [&mut self.uvs, &mut self.second_uvs].into_iter().filter(|uvs| !uvs.is_empty()) {
            let (a, b) = (uvs[i], uvs[j]);
            uvs.push([0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]);
        }
        if !self.tangents.is_empty() {
            let ([ax, ay, az, sign], [bx, by, bz, _]) = (self.tangents[i], self.tangents[j]);
            let [x, y, z] = bisector(double([ax, ay, az]), double([bx, by, bz]));
            self.tangents.push([x, y, z, sign]);
        }
        middle
    }
}

impl Scene {
    /// Appends a material and returns its index.
    pub fn add_material(&mut self, material: Material) -> usize {
        self.materials.push(material);
        self.materials.len() - 1
    }

    /// Appends a mesh with this name and material, and an instance of it where it is; returns the mesh's index.
    pub fn add_mesh(&mut self, name: &str, material: usize, mesh: Mesh) -> usize {
        self.place_mesh(name, material, mesh, DAffine3::IDENTITY)
    }

    /// As [`Self::add_mesh`], with the instance placed by `transform`.
    pub fn place_mesh(&mut self, name: &str, material: usize, mesh: Mesh, transform: DAffine3) -> usize {
        // coordinates that no texture needs would only take memory
        let used = self.materials.get(material);
        let uvs = if used.is_some_and(Material::is_textured) { mesh.uvs } else { Vec::new() };
        let second_uvs = if used.is_some_and(Material::needs_second_uvs) { mesh.second_uvs } else { Vec::new() };
        self.instances.push(Instance::new(self.meshes.len(), transform));
        self.meshes.push(Mesh { name: name.to_owned(), material, uvs, second_uvs, ..mesh }.into());
        self.meshes.len() - 1
    }

    /// Adds a parallelogram that emits `radiance` to its front, see [`Mesh::quad`], or to both sides; it reflects
    /// nothing.
    pub fn add_quad_light(&mut self, corner: DVec3, edges: [DVec3; 2], radiance: [f32; 3], two_sided: bool) {
        let material = Material::emitter("quad light", [0.0; 3], radiance);
        let material = self.add_material(Material { two_sided_emission: two_sided, ..material });
        self.add_mesh("quad light", material, Mesh::quad(corner, edges));
    }

    /// Adds a sphere that emits `radiance` outwards and reflects nothing: a mesh of 1280 triangles with the sphere's
    /// area and so its power, `4 pi^2 radius^2 radiance`. Its outline deviates from the sphere's by less than 0.4 % of
    /// the radius.
    pub fn add_sphere_light(&mut self, centre: DVec3, radius: f64, radiance: [f32; 3]) {
        let material = self.add_material(Material::emitter("sphere light", [0.0; 3], radiance));
        self.add_mesh("sphere light", material, Mesh::sphere(centre, radius, SPHERE_LIGHT_LEVEL));
    }

    /// The scene with each triangle split in `4^levels` of the same plane: the same picture at more cost. Meshes that
    /// deform keep their triangles.
    pub fn subdivided(mut self, levels: u32) -> Scene {
        let deforming: BTreeSet<usize> = self.animation.rig.deformations.iter().map(|d| d.mesh).collect();
        for _ in 0..levels {
            for (_, mesh) in self.meshes.iter_mut().enumerate().filter(|(index, _)| !deforming.contains(index)) {
                *mesh = mesh.split().into();
            }
        }
        self
    }
}

/// The unit vector between two; the first where they are opposite.
fn bisector(a: DVec3, b: DVec3) -> [f32; 3] {
    (a + b).normalize_or(a).as_vec3().to_array()
}

/// Normal (outwards, upwards) of a profile at point `i`: the mean of the adjoining pieces'.
fn profile_normal(profile: &[[f64; 2]], i: usize) -> [f64; 2] {
    let piece = |a: usize, b: usize| match (profile.get(a), profile.get(b)) {
        (Some(a), Some(b)) => {
            let (dr, dy) = (b[0] - a[0], b[1] - a[1]);
            let length = dr.hypot(dy);
            if length > 0.0 { [dy / length, -dr / length] } else { [0.0; 2] }
        }
        _ => [0.0; 2],
    };
    let before = piece(i.wrapping_sub(1), i);
    let after = piece(i, i + 1);
    let sum = [before[0] + after[0], before[1] + after[1]];
    if profile[i][0] == 0.0 {
        return [0.0, if sum[1] < 0.0 { -1.0 } else { 1.0 }];
    }
    let length = sum[0].hypot(sum[1]);
    if length > 0.0 { sum.map(|x| x / length) } else { [1.0, 0.0] }
}

/// The icosahedron in the unit sphere, front sides out.
fn icosahedron() -> Mesh {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z).normalize().as_vec3().to_array();
    let positions = [-1.0, 1.0]
        .iter()
        .flat_map(|&a| [-golden, golden].map(|b| [corner(0.0, a, b), corner(a, b, 0.0), corner(b, 0.0, a)]))
        .flatten()
        .collect::<Vec<_>>();
    let near = |i: u32, j: u32| double(positions[i as usize]).distance(double(positions[j as usize])) < 1.1;
    let mut indices = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let [p, q, r] = [a, b, c].map(|i| double(positions[i as usize]));
                    let outwards = (q - p).cross(r - p).dot(p) > 0.0;
                    indices.push(if outwards { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    Mesh { positions, indices, ..Mesh::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_is_closed_and_has_the_spheres_area() {
        let centre = DVec3::new(1.0, -2.0, 3.0);
        for level in 0..5 {
            let mesh = Mesh::sphere(centre, 0.5, level);
            assert_eq!(mesh.indices.len(), 20 * 4_usize.pow(level));
            assert!(mesh.is_closed());
            let area = std::f64::consts::PI;
            assert!((mesh.area() - area).abs() < 1e-5 * area, "{level}: {}", mesh.area());
            for [a, b, c] in mesh.triangles() {
                assert!((b - a).cross(c - a).dot(a - centre) > 0.0, "front sides are out");
            }
        }
    }

    #[test]
    fn a_sphere_light_is_as_round_as_documented() {
        let mut scene = Scene::default();
        scene.add_sphere_light(DVec3::ZERO, 1.0, [1.0; 3]);
        let mesh = &scene.meshes[0];
        assert_eq!(mesh.indices.len(), 1280);
        for triangle in mesh.triangles() {
            let plane = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalize().dot(triangle[0]);
            assert!(plane > 0.996 && triangle.iter().all(|corner| corner.length() < 1.004), "{plane} {triangle:?}");
        }
    }

    #[test]
    fn a_cuboid_faces_out() {
        let [lo, hi] = [DVec3::new(-1.0, 0.0, 2.0), DVec3::new(0.0, 3.0, 4.0)];
        let mesh = Mesh::cuboid(lo, hi);
        assert!((mesh.area() - 22.0).abs() < 1e-6);
        for [a, b, c] in mesh.triangles() {
            assert!((b - a).cross(c - a).dot(a - 0.5 * (lo + hi)) > 0.0);
        }
    }

    #[test]
    fn a_lathe_between_points_of_the_axis_is_closed_and_faces_out() {
        let mesh = Mesh::lathe(&[[0.0, -1.0], [1.0, 0.0], [0.0, 1.0]], 16);
        assert!(mesh.is_closed());
        for (triangle, [a, b, c]) in mesh.indices.iter().zip(mesh.triangles()) {
            let face = (b - a).cross(c - a);
            assert!(face.length() > 1e-3 && face.dot(a + b + c) > 0.0, "{face}");
            assert!(triangle.iter().all(|&i| double(mesh.normals[i as usize]).dot(face) > 0.0));
        }
    }

    #[test]
    fn subdivision_keeps_area_closedness_and_attributes() {
        let mut scene = Scene::default();
        scene.add_mesh("sphere", 0, Mesh::sphere(DVec3::ZERO, 1.0, 1));
        scene.add_mesh("quad", 0, Mesh::quad(DVec3::ZERO, [DVec3::X, DVec3::Y]));
        let before = scene.clone();
        let after = scene.subdivided(2);
        for (coarse, fine) in before.meshes.iter().zip(&after.meshes) {
            assert_eq!(fine.indices.len(), 16 * coarse.indices.len());
            assert!((fine.area() / coarse.area() - 1.0).abs() < 1e-6);
            assert_eq!(fine.is_closed(), coarse.is_closed());
            assert!(fine.normals.iter().all(|&n| (double(n).length() - 1.0).abs() < 1e-6));
            assert!(fine.normals.is_empty() || fine.normals.len() == fine.positions.len());
            assert!(fine.uvs.is_empty() || fine.uvs.len() == fine.positions.len());
        }
        assert_eq!(after.meshes[1].positions.len(), 25);
        assert!(after.meshes[1].positions.iter().zip(&after.meshes[1].uvs).all(|(p, uv)| [p[0], p[1]] == *uv));
    }
}
