//! The tree in memory: nodes of eight children, leaves of eight triangles.

use super::simd::{Array8, F32x8, WIDTH};
use glam::Vec3;
use restir_shared::layout::TRIANGLE_ALPHA;

/// Marks a child as a leaf; the other bits are its index.
pub(super) const LEAF: u32 = 1 << 31;

/// Marks the id of a triangle that is not everywhere, as in the arena.
pub(super) const PARTIAL: u32 = TRIANGLE_ALPHA;

/// Up to eight children. Slots without one have boxes that nothing hits.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// For each axis the lower and the upper planes of the children's boxes.
    pub planes: [[Array8; 2]; 3],
    /// [`LEAF`] and the index of a leaf, or the index of a node.
    pub children: [u32; WIDTH],
    /// The children with a triangle that emits, as bits.
    pub emitters: u32,
}

/// Up to eight triangles. The other lanes hold triangles without an area, which nothing hits.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Leaf {
    /// Vertices, each by axis.
    pub vertices: [[Array8; 3]; 3],
    /// The triangles' ids, with their marks.
    pub ids: [u32; WIDTH],
}

/// A child of a node.
pub(super) enum Child<'a> {
    Node(&'a Node),
    Leaf(&'a Leaf),
}

/// Nodes and leaves, whose references to each other are indices that there are.
#[derive(Debug)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    pub leaves: Vec<Leaf>,
    /// As a child of a node.
    pub root: u32,
    /// Some triangle is marked.
    pub partial: bool,
    /// Nodes on the longest way from the root, at most [`restir_shared::layout::TREE_DEPTH`].
    pub depth: usize,
    /// Of the scene.
    pub bounds: [Vec3; 2],
}

impl Tree {
    /// What a reference to a child stands for.
    #[inline(always)]
    pub(super) fn child(&self, reference: u32) -> Child<'_> {
        // SAFETY: references of a `Tree` are indices of its leaves and nodes
        unsafe {
            if reference & LEAF != 0 {
                Child::Leaf(self.leaves.get_unchecked((reference & !LEAF) as usize))
            } else {
                Child::Node(self.nodes.get_unchecked(reference as usize))
            }
        }
    }
}

/// The vertices of a triangle in each lane.
pub(super) trait Vertices<L: F32x8>: Copy {
    /// A coordinate of a vertex, each counted from 0.
    fn coordinate(self, vertex: usize, axis: usize) -> L;

    /// The least and the greatest coordinate.
    #[inline(always)]
    fn bounds(self, axis: usize) -> [L; 2] {
        let (a, b, c) = (self.coordinate(0, axis), self.coordinate(1, axis), self.coordinate(2, axis));
        [a.min(b).min(c), a.max(b).max(c)]
    }
}

/// The triangles of the leaf.
impl<L: F32x8> Vertices<L> for &Leaf {
    #[inline(always)]
    fn coordinate(self, vertex: usize, axis: usize) -> L {
        L::load(&self.vertices[vertex][axis])
    }
}

/// One triangle of a leaf, the same in every lane.
#[derive(Clone, Copy)]
pub(super) struct One<'a>(pub &'a Leaf, pub usize);

impl<L: F32x8> Vertices<L> for One<'_> {
    #[inline(always)]
    fn coordinate(self, vertex: usize, axis: usize) -> L {
        L::splat(self.0.vertices[vertex][axis].0[self.1])
    }
}
