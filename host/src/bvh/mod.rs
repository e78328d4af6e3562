//! BVH construction: [`cluster`] builds a tree, obvhs improves it, and this module turns it into the kernels' nodes.

mod cluster;

use glam::{UVec4, Vec3};
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse, reinsertion::ReinsertionOptimizer};
use obvhs::{Boundable, aabb::Aabb};
use restir_shared::layout::{LEAF, LEAF_COUNT_SHIFT, LEAF_MAX_COUNT, MAX_TRIANGLES, NODE_WORDS, TREE_DEPTH};
use restir_shared::{pack::xyz, scene::SceneView};
use std::ops::Range;

/// Leaves hold up to this many triangles.
const LEAF_SIZE: u32 = 4;
/// Cost of visiting a node, in units of testing a triangle, by which leaves are made.
const COLLAPSE_COST: f32 = 3.0;
/// Where more nodes than this preferred others all at once, their boxes contain each other, and the search for a better place of each
/// would visit most of the tree: time would grow with the square of their number.
const MOST_STALLED: usize = 1 << 14;

/// How much is done for a good tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// In so many first rounds of clustering, those with the most nodes, a node is compared only with the ones beside it.
    quick_rounds: usize,
    /// For which part of the nodes, those with the largest boxes, a better place is sought before and after leaves are made.
    reinserted: [f32; 2],
    /// For how many nodes at most, so that a large scene does not wait for its tree.
    most_reinserted: f32,
}

impl Effort {
    /// For the tree of the arena. Another one has its triangles, and so its lights, in another order, and gives other films.
    pub(crate) const QUICK: Self = Self { quick_rounds: 3, reinserted: [0.05, 0.1], most_reinserted: f32::INFINITY };
    /// For a tree that many rays are traced through.
    pub(crate) const THOROUGH: Self =
        Self { quick_rounds: 0, reinserted: [1.0, 0.0], most_reinserted: (1 << 17) as f32 };
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    /// Lower corner.
    pub lo: Vec3,
    /// Upper corner.
    pub hi: Vec3,
}

impl Bounds {
    /// The box that contains nothing.
    pub(crate) const EMPTY: Self = Self { lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY };

    /// The bounds of a triangle.
    pub(crate) fn of(triangle: &[Vec3; 3]) -> Self {
        triangle.iter().map(|&v| Self { lo: v, hi: v }).fold(Self::EMPTY, Self::union)
    }

    /// The bounds of both.
    #[must_use]
    pub(crate) fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }
}

/// An inner node: the boxes of its children and references to them, see [`restir_shared::layout`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    /// Boxes of the children, exactly the union of their triangles' bounds.
    pub bounds: [Bounds; 2],
    /// References to the children.
    pub children: [u32; 2],
}

/// A binary BVH.
#[derive(Clone, Debug)]
pub(crate) struct Bvh {
    /// Inner nodes, parents before children.
    pub nodes: Vec<Node>,
    /// Reference to the root.
    pub root: u32,
    /// The triangles in the order of the leaves.
    pub order: Vec<u32>,
    /// Bounds of everything.
    pub bounds: Bounds,
}

impl Bvh {
    /// The tree that a scene's arena holds, with the arena's order of triangles.
    pub(crate) fn of_arena(scene: &SceneView<'_>) -> Self {
        let header = &scene.header;
        let box_of = |lo, hi| Bounds { lo: xyz(lo), hi: xyz(hi) };
        let node = |words: &[UVec4]| Node {
            bounds: [box_of(words[0], words[1]), box_of(words[2], words[3])],
            children: [words[0].w, words[1].w],
        };
        let words = &scene.geometry[header.node_base as usize..header.triangle_base as usize];
        let [lo, hi] = [header.bounds_lo, header.bounds_hi].map(Vec3::from_array);
        Self {
            nodes: words.chunks_exact(NODE_WORDS as usize).map(node).collect(),
            root: header.root,
            order: (0..header.triangle_count).collect(),
            bounds: Bounds { lo, hi },
        }
    }

    /// Most nodes that a traversal can have pending.
    pub(crate) fn depth(&self) -> usize {
        let mut levels = vec![1; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate() {
            for child in node.children.into_iter().filter(|&child| leaf(child).is_none()) {
                levels[child as usize] = levels[index] + 1;
            }
        }
        levels.into_iter().max().unwrap_or(0)
    }

    /// With boxes from the leaves up; `of` gives that of a triangle by its place in the order of the leaves.
    fn fitted(mut self, of: impl Fn(usize) -> Bounds) -> Self {
        for index in (0..self.nodes.len()).rev() {
            self.nodes[index].bounds = self.nodes[index].children.map(|child| self.bounds_of(child, &of));
        }
        self.bounds = self.bounds_of(self.root, &of);
        self
    }

    fn bounds_of(&self, reference: u32, of: &impl Fn(usize) -> Bounds) -> Bounds {
        match leaf(reference) {
            Some(places) => places.map(of).fold(Bounds::EMPTY, Bounds::union),
            None => {
                let [a, b] = self.nodes[reference as usize].bounds;
                a.union(b)
            }
        }
    }
}

/// The places of its triangles in the order of the leaves, if a reference is one to a leaf.
pub(crate) fn leaf(reference: u32) -> Option<Range<usize>> {
    let first = (reference & (MAX_TRIANGLES - 1)) as usize;
    let count = (reference >> LEAF_COUNT_SHIFT & LEAF_MAX_COUNT) as usize;
    (reference & LEAF != 0).then_some(first..first + count)
}

/// A node of a tree before it is laid out; the root is the first.
#[derive(Clone, Copy)]
struct TreeNode {
    /// First of the node's triangles in the order of the leaves; first of its two children if it has no triangles.
    first: u32,
    count: u32,
}

/// Builds a BVH over at least one triangle with finite bounds.
pub(crate) fn build(boxes: &[Bounds], effort: Effort) -> Bvh {
    let (tree, order) = surface_area_tree(boxes, effort);
    let bvh = lay_out(&tree, order, boxes);
    if bvh.depth() <= TREE_DEPTH {
        return bvh;
    }
    // a chain of nested or geometrically growing triangles: balance bounds the depth, whatever the shapes
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let tree = balanced_tree(&mut order, boxes);
    lay_out(&tree, order, boxes)
}

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        // by way of arrays, for obvhs may have another version of glam than the kernels
        Aabb::new(self.lo.to_array().into(), self.hi.to_array().into())
    }
}

fn surface_area_tree(boxes: &[Bounds], effort: Effort) -> (Vec<TreeNode>, Vec<u32>) {
    let (mut bvh, stalled) = cluster::tree(boxes, effort.quick_rounds);
    let mut reinsertion = ReinsertionOptimizer::default();
    let mut improve = |bvh: &mut Bvh2, part: f32| {
        if stalled <= MOST_STALLED {
            let most = effort.most_reinserted / bvh.nodes.len() as f32;
            reinsertion.run(bvh, part.min(most), None);
        }
    };
    improve(&mut bvh, effort.reinserted[0]);
    collapse(&mut bvh, LEAF_SIZE, COLLAPSE_COST);
    improve(&mut bvh, effort.reinserted[1]);
    let nodes = bvh.nodes.iter().map(|node| TreeNode { first: node.first_index, count: node.prim_count });
    (nodes.collect(), bvh.primitive_indices)
}

/// Halves at the median of the longest axis.
fn balanced_tree(order: &mut [u32], boxes: &[Bounds]) -> Vec<TreeNode> {
    let mut nodes = vec![TreeNode { first: 0, count: 0 }];
    let mut work = vec![(0, 0..order.len())];
    while let Some((index, range)) = work.pop() {
        let part = &mut order[range.clone()];
        if part.len() <= LEAF_SIZE as usize {
            nodes[index] = TreeNode { first: range.start as u32, count: part.len() as u32 };
            continue;
        }
        let bounds = part.iter().map(|&i| boxes[i as usize]).fold(Bounds::EMPTY, Bounds::union);
        let axis = (bounds.hi - bounds.lo).max_position();
        let key = |i: u32| boxes[i as usize].lo[axis] * 0.5 + boxes[i as usize].hi[axis] * 0.5;
        let half = part.len() / 2;
        part.select_nth_unstable_by(half, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        let first = nodes.len();
        nodes[index] = TreeNode { first: first as u32, count: 0 };
        nodes.extend([TreeNode { first: 0, count: 0 }; 2]);
        let middle = range.start + half;
        work.extend([(first + 1, middle..range.end), (first, range.start..middle)]);
    }
    nodes
}

/// Numbers the inner nodes and finds boxes and depth.
fn lay_out(tree: &[TreeNode], order: Vec<u32>, boxes: &[Bounds]) -> Bvh {
    let mut bvh = Bvh { nodes: Vec::new(), root: 0, order: Vec::new(), bounds: Bounds::EMPTY };
    // (node of the tree, its parent and which child of it); children are numbered after their parent
    let mut work = vec![(0_u32, None)];
    while let Some((index, parent)) = work.pop() {
        let TreeNode { first, count } = tree[index as usize];
        let reference = if count > 0 {
            LEAF | (count << LEAF_COUNT_SHIFT) | first
        } else {
            let node = bvh.nodes.len();
            bvh.nodes.push(Node { bounds: [Bounds::EMPTY; 2], children: [0; 2] });
            work.extend([(first + 1, Some((node, 1))), (first, Some((node, 0)))]);
            node as u32
        };
        match parent {
            Some((node, side)) => bvh.nodes[node].children[side] = reference,
            None => bvh.root = reference,
        }
    }
    let bvh = bvh.fitted(|place| boxes[order[place] as usize]);
    Bvh { order, ..bvh }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(triangles: &[[Vec3; 3]]) {
        let boxes: Vec<Bounds> = triangles.iter().map(Bounds::of).collect();
        for effort in [Effort::QUICK, Effort::THOROUGH] {
            check_tree(&build(&boxes, effort), &boxes);
        }
    }

    fn check_tree(bvh: &Bvh, boxes: &[Bounds]) {
        assert!(bvh.depth() <= TREE_DEPTH, "depth {}", bvh.depth());
        let mut order = bvh.order.clone();
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..boxes.len() as u32), "each triangle is in one leaf");
        let mut work = vec![(bvh.root, bvh.bounds)];
        while let Some((reference, bounds)) = work.pop() {
            if let Some(places) = leaf(reference) {
                let triangles = bvh.order[places].iter().map(|&i| boxes[i as usize]);
                assert_eq!(bounds, triangles.fold(Bounds::EMPTY, Bounds::union));
            } else {
                let node = &bvh.nodes[reference as usize];
                assert_eq!(bounds, node.bounds[0].union(node.bounds[1]));
                work.extend(node.children.into_iter().zip(node.bounds));
            }
        }
    }

    fn triangle(at: Vec3, size: f32) -> [Vec3; 3] {
        [at, at + Vec3::X * size, at + Vec3::Y * size]
    }

    #[test]
    fn one_triangle() {
        check(&[triangle(Vec3::ZERO, 1.0)]);
    }

    #[test]
    fn a_chain_that_grows_geometrically() {
        let sizes = std::iter::successors(Some(1.0e-12), |size| Some(size * 1.25)).take_while(|&size| size < 1.0e12);
        check(&sizes.map(|size| triangle(Vec3::splat(size), size)).collect::<Vec<_>>());
    }

    #[test]
    fn shapes_that_let_every_triangle_prefer_another() {
        // a builder whose rounds merge one pair of them would take minutes to hours
        let row = |i: i32| triangle(Vec3::X * i as f32, 1.0);
        let strip = |i: i32| triangle(Vec3::X * (i / 2) as f32 + Vec3::Y * (i % 2) as f32 * 0.5, 1.0);
        let nested = |i: i32| triangle(Vec3::splat(-0.5 * i as f32), i as f32);
        let fan = |i: i32| triangle(Vec3::ZERO, i as f32);
        let crowd = |i: i32| triangle(Vec3::splat((i % 7) as f32), 1.0);
        let alone = |i: i32| triangle(Vec3::splat(i as f32 * 0.01), 0.5);
        for shape in [row, strip, nested, fan, crowd] {
            check(&(0..200_000).map(shape).collect::<Vec<_>>());
        }
        check(&(0..200_000).map(crowd).chain((0..2_000).map(alone)).collect::<Vec<_>>());
        check(&vec![triangle(Vec3::ONE, 1.0); 1_000_000]);
    }
}
