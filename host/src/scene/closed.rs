//! Whether meshes enclose something.

use super::Mesh;
use std::collections::HashMap;

/// Vertices that are nearer than this part of the mesh's size are one: some roundings to single precision.
const ROUNDING: f64 = 1.0e-6;

/// Whether each edge of a mesh, from position to position, is met as often in one direction as in the other. Positions may differ by
/// roundings, as at the seam of a sphere.
#[cfg(any(feature = "gltf", test))]
pub(super) fn is_closed(mesh: &Mesh) -> bool {
    closed(mesh).is_some()
}

/// The mesh if it is closed, with positions that differ by roundings made equal where it is not closed without, so that no ray passes between them.
pub(crate) fn closed(mesh: &Mesh) -> Option<Mesh> {
    if is_balanced(mesh, &representatives(mesh, 0.0)) {
        return Some(mesh.clone());
    }
    let representatives = representatives(mesh, ROUNDING);
    let positions = representatives.iter().map(|&vertex| mesh.positions[vertex as usize]).collect();
    is_balanced(mesh, &representatives).then(|| Mesh { positions, ..mesh.clone() })
}

fn is_balanced(mesh: &Mesh, representatives: &[u32]) -> bool {
    let mut edges = HashMap::new();
    for triangle in &mesh.indices {
        let [a, b, c] = triangle.map(|index| representatives[index as usize]);
        // an edge of a triangle without an area goes from a vertex to itself
        for (from, to) in [(a, b), (b, c), (c, a)].into_iter().filter(|(from, to)| from != to) {
            *edges.entry((from.min(to), from.max(to))).or_insert(0_i64) += if from < to { 1 } else { -1 };
        }
    }
    !mesh.indices.is_empty() && edges.values().all(|&balance| balance == 0)
}

/// For each vertex the first one that is nearer than `tolerance` times the size of the mesh, by axis; with 0, that is in the same place.
fn representatives(mesh: &Mesh, tolerance: f64) -> Vec<u32> {
    let positions = || mesh.positions.iter().map(|position| super::double(*position));
    let bound = |axis: usize| {
        positions().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], p| [lo.min(p[axis]), hi.max(p[axis])])
    };
    let size = (0..3).map(bound).fold(0.0, |most: f64, [lo, hi]| most.max(hi - lo));
    let cell = tolerance * size;
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut first = Vec::with_capacity(mesh.positions.len());
    for (index, position) in positions().enumerate() {
        // with 0, a cell for each value
        let place = |x: f64| if cell > 0.0 { (x / cell).floor() as i64 } else { (x + 0.0).to_bits() as i64 };
        let at = position.to_array().map(place);
        let near =
            |other: &&u32| (super::double(mesh.positions[**other as usize]) - position).abs().max_element() <= cell;
        let found = around(at, cell > 0.0).find_map(|place| cells.get(&place)?.iter().find(near).copied());
        let representative = found.unwrap_or(index as u32);
        if found.is_none() {
            cells.entry(at).or_default().push(representative);
        }
        first.push(representative);
    }
    first
}

/// A cell, and with `wide` those around it.
fn around(at: [i64; 3], wide: bool) -> impl Iterator<Item = [i64; 3]> {
    let reach = i64::from(wide);
    let steps = -reach..=reach;
    let offsets = move |x: i64| steps.clone().flat_map(move |y| (-reach..=reach).map(move |z| [x, y, z]));
    let of = move |[x, y, z]: [i64; 3]| [at[0].wrapping_add(x), at[1].wrapping_add(y), at[2].wrapping_add(z)];
    (-reach..=reach).flat_map(offsets).map(of)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn bodies_are_closed_meshes() {
        assert!(is_closed(&Mesh::cuboid(DVec3::ZERO, DVec3::ONE)) && is_closed(&Mesh::sphere(DVec3::ZERO, 1.0, 2)));
        assert!(!is_closed(&Mesh::quad(DVec3::ZERO, [DVec3::X, DVec3::Y])) && !is_closed(&Mesh::default()));
    }

    /// A box whose faces have vertices of their own that are off by a rounding is closed, and by more it is not.
    #[test]
    fn seams_may_be_off_by_a_rounding() {
        let cuboid = |off: f32| {
            let mut mesh = Mesh::cuboid(DVec3::ZERO, DVec3::ONE);
            let spread: Vec<[f32; 3]> = mesh.indices.iter().flatten().map(|&i| mesh.positions[i as usize]).collect();
            mesh.indices = (0..spread.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let moved = |(i, [x, y, z]): (usize, &[f32; 3])| [x + off * (i % 3) as f32, *y, z - off];
            mesh.positions = spread.iter().enumerate().map(moved).collect();
            Mesh { normals: Vec::new(), uvs: Vec::new(), second_uvs: Vec::new(), tangents: Vec::new(), ..mesh }
        };
        assert!(is_closed(&cuboid(0.0)) && is_closed(&cuboid(2.0e-7)) && !is_closed(&cuboid(1.0e-3)));
        let welded = closed(&cuboid(2.0e-7)).unwrap();
        assert!(is_balanced(&welded, &representatives(&welded, 0.0)));
    }
}
