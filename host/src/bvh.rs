//! BVH construction: obvhs builds the tree, this module turns it into the kernels' nodes.

use glam::Vec3;
use obvhs::{BvhBuildParams, aabb::Aabb, bvh2::builder::build_bvh2};
use restir_shared::layout::{LEAF, LEAF_COUNT_SHIFT, STACK_DEPTH};
use std::time::Duration;

/// Leaves hold up to this many triangles.
const LEAF_SIZE: u32 = 4;

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
        triangle.iter().fold(Self::EMPTY, |b, v| b.union(Self { lo: *v, hi: *v }))
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
#[derive(Debug)]
pub(crate) struct Bvh {
    /// Inner nodes, parents before children.
    pub nodes: Vec<Node>,
    /// Reference to the root.
    pub root: u32,
    /// The triangles in the order of the leaves.
    pub order: Vec<u32>,
    /// Bounds of everything.
    pub bounds: Bounds,
    /// Most nodes that a traversal can have pending.
    pub depth: usize,
}

/// A node's parent: its index, and which of its children the node is.
type Parent = Option<(usize, usize)>;

/// A tree before it is laid out.
enum Tree {
    Leaf { first: usize, count: usize },
    Inner(Box<[Tree; 2]>),
}

/// Builds a BVH over at least one triangle with finite vertices.
pub(crate) fn build(triangles: &[[Vec3; 3]]) -> Bvh {
    let boxes: Vec<Bounds> = triangles.iter().map(Bounds::of).collect();
    let (tree, order) = surface_area_tree(&boxes);
    let bvh = lay_out(&tree, order, &boxes);
    if bvh.depth <= STACK_DEPTH {
        return bvh;
    }
    // a chain of nested or geometrically growing triangles: balance bounds the depth, whatever the shapes
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let tree = balanced_tree(&mut order, 0, &boxes);
    lay_out(&tree, order, &boxes)
}

fn surface_area_tree(boxes: &[Bounds]) -> (Tree, Vec<u32>) {
    let aabbs: Vec<Aabb> = boxes.iter().map(|b| Aabb::new(b.lo.into(), b.hi.into())).collect();
    let params = BvhBuildParams { max_prims_per_leaf: LEAF_SIZE, ..BvhBuildParams::medium_build() };
    let bvh = build_bvh2(&aabbs, params, &mut Duration::default());
    // depth-first without recursion: the tree may be as deep as it has triangles
    let mut done: Vec<Tree> = Vec::new();
    let mut work = vec![(0_usize, false)];
    while let Some((index, children_done)) = work.pop() {
        let node = &bvh.nodes[index];
        if node.is_leaf() {
            done.push(Tree::Leaf { first: node.first_index as usize, count: node.prim_count as usize });
        } else if children_done {
            if let (Some(b), Some(a)) = (done.pop(), done.pop()) {
                done.push(Tree::Inner(Box::new([a, b])));
            }
        } else {
            let first = node.first_index as usize;
            work.extend([(index, true), (first + 1, false), (first, false)]);
        }
    }
    let root = done.pop().unwrap_or(Tree::Leaf { first: 0, count: 0 });
    (root, bvh.primitive_indices)
}

fn balanced_tree(order: &mut [u32], first: usize, boxes: &[Bounds]) -> Tree {
    if order.len() <= LEAF_SIZE as usize {
        return Tree::Leaf { first, count: order.len() };
    }
    let bounds = order.iter().fold(Bounds::EMPTY, |b, &i| b.union(boxes[i as usize]));
    let size = bounds.hi - bounds.lo;
    let axis = size.max_position();
    let middle = order.len() / 2;
    let key = |i: u32| boxes[i as usize].lo[axis] * 0.5 + boxes[i as usize].hi[axis] * 0.5;
    order.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    let (left, right) = order.split_at_mut(middle);
    Tree::Inner(Box::new([balanced_tree(left, first, boxes), balanced_tree(right, first + middle, boxes)]))
}

/// Numbers the inner nodes, and computes boxes and depth from the leaves up.
fn lay_out(tree: &Tree, order: Vec<u32>, boxes: &[Bounds]) -> Bvh {
    let mut nodes: Vec<Node> = Vec::new();
    let empty = Node { bounds: [Bounds::EMPTY; 2], children: [0; 2] };
    // (tree, its parent and side); children are numbered after their parent
    let mut work: Vec<(&Tree, Parent, usize)> = vec![(tree, None, 0)];
    let mut root = 0;
    let mut depth = 0;
    let mut parents: Vec<Parent> = Vec::new();
    let mut bounds = Bounds::EMPTY;
    while let Some((tree, parent, level)) = work.pop() {
        let reference = match tree {
            Tree::Leaf { first, count } => {
                let leaf = order[*first..*first + *count].iter();
                let leaf_bounds = leaf.fold(Bounds::EMPTY, |b, &i| b.union(boxes[i as usize]));
                match parent {
                    Some((node, side)) => nodes[node].bounds[side] = leaf_bounds,
                    None => bounds = leaf_bounds,
                }
                LEAF | ((*count as u32) << LEAF_COUNT_SHIFT) | *first as u32
            }
            Tree::Inner(children) => {
                let index = nodes.len();
                nodes.push(empty);
                parents.push(parent);
                depth = depth.max(level + 1);
                work.push((&children[1], Some((index, 1)), level + 1));
                work.push((&children[0], Some((index, 0)), level + 1));
                index as u32
            }
        };
        match parent {
            Some((node, side)) => nodes[node].children[side] = reference,
            None => root = reference,
        }
    }
    for index in (0..nodes.len()).rev() {
        let union = nodes[index].bounds[0].union(nodes[index].bounds[1]);
        match parents[index] {
            Some((parent, side)) => nodes[parent].bounds[side] = union,
            None => bounds = union,
        }
    }
    Bvh { nodes, root, order, bounds, depth }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(triangles: &[[Vec3; 3]]) {
        let bvh = build(triangles);
        assert!(bvh.depth <= STACK_DEPTH, "depth {}", bvh.depth);
        let mut order = bvh.order.clone();
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..triangles.len() as u32), "each triangle is in one leaf");
        let mut work = vec![(bvh.root, bvh.bounds)];
        while let Some((reference, bounds)) = work.pop() {
            if reference & LEAF == 0 {
                let node = &bvh.nodes[reference as usize];
                assert_eq!(bounds, node.bounds[0].union(node.bounds[1]));
                work.extend(node.children.into_iter().zip(node.bounds));
            } else {
                let first = (reference & ((1 << LEAF_COUNT_SHIFT) - 1)) as usize;
                let count = ((reference & !LEAF) >> LEAF_COUNT_SHIFT) as usize;
                let union = bvh.order[first..first + count]
                    .iter()
                    .fold(Bounds::EMPTY, |b, &i| b.union(Bounds::of(&triangles[i as usize])));
                assert_eq!(bounds, union);
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
        let mut size = 1.0e-12;
        let mut triangles = Vec::new();
        while size < 1.0e12 {
            triangles.push(triangle(Vec3::splat(size), size));
            size *= 1.25;
        }
        check(&triangles);
    }

    #[test]
    fn ten_thousand_triangles_in_one_place() {
        check(&vec![triangle(Vec3::ONE, 1.0); 10_000]);
    }
}
