//! Closed meshes from implicit surfaces.

use std::collections::HashMap;

use glam::{DVec3, UVec3};
use rayon::prelude::*;

use crate::scene::Mesh;

/// Where a surface may cross an edge of the grid, as a fraction of its length: not at a vertex, so that no triangle
/// is without area.
const CROSSING: (f64, f64) = (0.1, 0.9);

/// The surface on which `distance` is zero, with the side where it is positive in front, and its gradient for normals.
///
/// By marching tetrahedra (Doi and Koide, "An efficient method of triangulating equi-valued surfaces by using
/// tetrahedral cells", 1991) on cubes of side `cell` that begin at `lo` and reach at least to `hi`; each is cut in six
/// tetrahedra about its diagonal (Kuhn's subdivision), in the same way, so that neighbours agree on their faces. The
/// mesh is a closed, oriented 2-manifold if `distance` is positive all over the boundary of the grid.
pub(super) fn isosurface(distance: impl Fn(DVec3) -> f64 + Sync, lo: DVec3, hi: DVec3, cell: f64) -> Mesh {
    let size = ((hi - lo) / cell).ceil().as_uvec3() + 1;
    let point = |index: u32| {
        let vertex = UVec3::new(index % size.x, index / size.x % size.y, index / (size.x * size.y));
        lo + cell * vertex.as_dvec3()
    };
    let values: Vec<f64> = (0..size.x * size.y * size.z).into_par_iter().map(|index| distance(point(index))).collect();
    let mut crossings = Crossings { values: &values, of_edge: HashMap::new(), edges: Vec::new() };
    let mut indices = Vec::new();
    for z in 0..size.z - 1 {
        for y in 0..size.y - 1 {
            for x in 0..size.x - 1 {
                let corner =
                    |bits: u32| (x + (bits & 1)) + size.x * ((y + (bits >> 1 & 1)) + size.y * (z + (bits >> 2)));
                let inside = (0..8).filter(|&bits| values[corner(bits) as usize] < 0.0).count();
                if inside != 0 && inside != 8 {
                    TETRAHEDRA.iter().for_each(|t| crossings.march(t.map(corner), &mut indices));
                }
            }
        }
    }
    let crossing = |&[a, b]: &[u32; 2]| {
        let (at_a, at_b) = (values[a as usize], values[b as usize]);
        point(a).lerp(point(b), (at_a / (at_a - at_b)).clamp(CROSSING.0, CROSSING.1))
    };
    let positions: Vec<DVec3> = crossings.edges.iter().map(crossing).collect();
    let step = 0.05 * cell;
    let normal = |p: &DVec3| {
        let slope = DVec3::AXES.map(|axis| distance(*p + axis * step) - distance(*p - axis * step));
        DVec3::from_array(slope).normalize_or(DVec3::Y).as_vec3().to_array()
    };
    Mesh {
        normals: positions.par_iter().map(normal).collect(),
        positions: positions.iter().map(|p| p.as_vec3().to_array()).collect(),
        indices,
        ..Mesh::default()
    }
}

/// Corners of a cube, x in the lowest bit, of six tetrahedra with positive volume.
const TETRAHEDRA: [[u32; 4]; 6] = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// The vertices of the surface, one on each edge of the grid that it crosses.
struct Crossings<'a> {
    values: &'a [f64],
    of_edge: HashMap<[u32; 2], u32>,
    edges: Vec<[u32; 2]>,
}

impl Crossings<'_> {
    fn vertex(&mut self, a: u32, b: u32) -> u32 {
        let edge = [a.min(b), a.max(b)];
        *self.of_edge.entry(edge).or_insert_with(|| {
            self.edges.push(edge);
            self.edges.len() as u32 - 1
        })
    }

    /// Appends the triangles of a tetrahedron of positive volume.
    fn march(&mut self, tetrahedron: [u32; 4], triangles: &mut Vec<[u32; 3]>) {
        let [sorted, inside] = self.sort(tetrahedron);
        let [a, b, c, d] = sorted;
        match inside.iter().filter(|&&flag| flag == 1).count() {
            1 => triangles.push([self.vertex(a, b), self.vertex(a, c), self.vertex(a, d)]),
            2 => {
                let quad = [self.vertex(a, c), self.vertex(a, d), self.vertex(b, d), self.vertex(b, c)];
                triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
            }
            3 => triangles.push([self.vertex(d, a), self.vertex(d, b), self.vertex(d, c)]),
            _ => {}
        }
    }

    /// An even permutation of the corners, of positive volume therefore, with those inside first; and which are inside.
    fn sort(&self, corners: [u32; 4]) -> [[u32; 4]; 2] {
        let inside = |corner: u32| u32::from(self.values[corner as usize] < 0.0);
        let mut sorted = corners;
        let mut odd = false;
        for end in (1..4).rev() {
            for i in 0..end {
                if inside(sorted[i]) < inside(sorted[i + 1]) {
                    sorted.swap(i, i + 1);
                    odd = !odd;
                }
            }
        }
        if odd {
            // two of the same kind: of four, the first two or the last two are
            let pair = if inside(sorted[0]) == inside(sorted[1]) { (0, 1) } else { (2, 3) };
            sorted.swap(pair.0, pair.1);
        }
        [sorted, sorted.map(inside)]
    }
}
