//! The geometry arena, word by word as in [`restir_shared::layout`]: nodes, triangles and, if the scene needs them, shading records and second sets of texture
//! coordinates.

use super::coincident::{self, Coincident};
use super::lights::{LightTables, emits};
use super::{Flat, arena::float_word, shading};
use crate::bvh::{Bounds, Node, leaf};
use crate::scene::{Material, Scene};
use glam::Vec3;
use restir_shared::layout::{LIGHT_TRIANGLE, NONE, TRIANGLE_ALPHA};
use std::{collections::BTreeSet, iter::repeat_n, ops::Range, sync::Arc};

/// Words of 32 bits.
const NODE: usize = 16;
/// A child's box, with a reference beside each corner of the first.
const BOX: usize = 8;
pub(super) const TRIANGLE: usize = 12;
const SHADING: usize = 12;
const SECOND_UVS: usize = 8;
/// Where a triangle's material, light and object are among its words.
const MATERIAL: usize = 3;
const LIGHT: usize = 7;
const OBJECT: usize = 11;

/// How the geometry comes about.
pub(super) enum Geometry<'a> {
    /// From nothing.
    New,
    /// From that of another moment, since which some objects have moved.
    Moved {
        /// The arena of that moment.
        before: &'a Arc<[u32]>,
        /// Of each object, whether it has moved.
        moved: &'a [bool],
        /// The triangles that were set apart then.
        apart: &'a BTreeSet<usize>,
    },
}

/// The arena but for what [`mark`] writes, the bounds of everything, and the lamps that lie in other surfaces.
pub(super) fn packed(scene: &Scene, flat: &Flat, geometry: Geometry<'_>) -> (Arc<[u32]>, Bounds, Coincident) {
    let (nodes, triangles) = (flat.bvh.nodes.len(), flat.triangles.len());
    let of_shading = if flat.with_shading { SHADING } else { 0 };
    let per_triangle = TRIANGLE + of_shading + if flat.with_second_uvs { SECOND_UVS } else { 0 };
    // of known length, so that the words are written where they stay: a copy of them would be the peak of memory
    let mut words: Arc<[u32]> = match geometry {
        Geometry::New => repeat_n(0, nodes * NODE + triangles * per_triangle).collect(),
        Geometry::Moved { before, .. } => before[..].into(),
    };
    // nobody else has them yet
    let free = Arc::get_mut(&mut words).unwrap_or_default();
    let (node_words, triangle_words) = free.split_at_mut(nodes * NODE);
    let (corner_words, other_words) = triangle_words.split_at_mut(triangles * TRIANGLE);
    let (shading_words, uv_words) = other_words.split_at_mut(triangles * of_shading);
    let emits: Vec<bool> = scene.materials.iter().map(emits).collect();
    let is_lamp = |index: usize| emits[flat.triangles[index].material(scene)];
    let is_moved = |index: usize| match geometry {
        Geometry::New => true,
        Geometry::Moved { moved, apart, .. } => moved[flat.triangles[index].object as usize] || apart.contains(&index),
    };
    for index in (0..triangles).filter(|&index| is_moved(index)) {
        let triangle = flat.triangles[index];
        let corners = triangle.vertices(scene).map(|corner| float_word(corner, 0));
        corner_words[index * TRIANGLE..][..TRIANGLE].copy_from_slice(corners.as_flattened());
        if flat.with_shading {
            let record = shading::record(scene, triangle);
            shading_words[index * SHADING..][..SHADING].copy_from_slice(record.as_flattened());
        }
        if flat.with_second_uvs {
            let record = shading::second_uvs(scene, triangle);
            uv_words[index * SECOND_UVS..][..SECOND_UVS].copy_from_slice(record.as_flattened());
        }
    }
    let bounds = fit(flat, node_words, corner_words, &is_moved);
    let coincident = coincident::set_apart(scene, flat, node_words, corner_words, &is_lamp);
    if coincident.moved.is_empty() {
        return (words, bounds, coincident);
    }
    let bounds = fit(flat, node_words, corner_words, &|index| coincident.moved.contains(&index));
    (words, bounds, coincident)
}

/// Fits the boxes of the nodes to their triangles, from the leaves up, where a triangle has moved; the bounds of everything.
fn fit(flat: &Flat, node_words: &mut [u32], corner_words: &[u32], is_moved: &dyn Fn(usize) -> bool) -> Bounds {
    let of_leaf =
        |leaf: Range<usize>| leaf.map(|at| triangle_bounds(corner_words, at)).fold(Bounds::EMPTY, Bounds::union);
    let mut changed = vec![false; flat.bvh.nodes.len()];
    for (index, Node { children, .. }) in flat.bvh.nodes.iter().enumerate().rev() {
        for (side, &child) in children.iter().enumerate() {
            let bounds = match leaf(child) {
                None => changed[child as usize].then(|| node_bounds(node_words, child as usize)),
                Some(leaf) => leaf.clone().any(is_moved).then(|| of_leaf(leaf)),
            };
            if let Some(Bounds { lo, hi }) = bounds {
                changed[index] = true;
                let reference = [children[0], children[1]].map(|child| if side == 0 { child } else { 0 });
                let words = [float_word(lo, reference[0]), float_word(hi, reference[1])];
                node_words[index * NODE + side * BOX..][..BOX].copy_from_slice(words.as_flattened());
            }
        }
    }
    match leaf(flat.bvh.root) {
        None => node_bounds(node_words, flat.bvh.root as usize),
        Some(leaf) => of_leaf(leaf),
    }
}

/// The union of a node's boxes.
fn node_bounds(node_words: &[u32], node: usize) -> Bounds {
    let [first, second] = child_bounds(node_words, node);
    first.union(second)
}

/// The boxes of a node's children.
pub(super) fn child_bounds(node_words: &[u32], node: usize) -> [Bounds; 2] {
    [0, BOX].map(|side| {
        let at = node * NODE + side;
        Bounds { lo: vector(node_words, at), hi: vector(node_words, at + 4) }
    })
}

fn triangle_bounds(corner_words: &[u32], triangle: usize) -> Bounds {
    Bounds::of(&[0, 4, 8].map(|corner| vector(corner_words, triangle * TRIANGLE + corner)))
}

pub(super) fn vector(words: &[u32], at: usize) -> Vec3 {
    Vec3::from_array([words[at], words[at + 1], words[at + 2]].map(f32::from_bits))
}

/// Writes what the triangles' words refer to: materials, lights and objects, and which of them may be transparent.
pub(super) fn mark(words: &mut Arc<[u32]>, scene: &Scene, flat: &Flat, tables: &LightTables) {
    let mark = |m: &Material| if flat.texels.alpha_flags(m) == 0 { 0 } else { TRIANGLE_ALPHA };
    let marks: Vec<u32> = scene.materials.iter().map(mark).collect();
    let objects = scene.objects();
    // nobody else has them yet
    let free = Arc::get_mut(words).unwrap_or_default();
    let triangle_words = &mut free[flat.bvh.nodes.len() * NODE..][..flat.triangles.len() * TRIANGLE];
    for (words, triangle) in triangle_words.chunks_exact_mut(TRIANGLE).zip(&flat.triangles) {
        let material = triangle.material(scene);
        let object = objects[triangle.object as usize];
        (words[MATERIAL], words[LIGHT], words[OBJECT]) = (material as u32, NONE, object | marks[material]);
    }
    for (index, light) in (0..).zip(&tables.lights).filter(|(_, light)| light.kind == LIGHT_TRIANGLE) {
        triangle_words[light.index as usize * TRIANGLE + LIGHT] = index;
    }
}
