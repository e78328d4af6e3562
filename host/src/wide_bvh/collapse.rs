//! From a binary tree to the wide one: nodes and leaves of least expected cost, by dynamic programming
//! over the number of roots that a subtree may have (Ylitie, Karras and Laine 2017, §3.1).

use super::node::{LEAF, Leaf, Node, PARTIAL, Tree};
use super::simd::{Array8, WIDTH};
use crate::bvh::{Bounds, Bvh, leaf};
use glam::Vec3;
use restir_shared::layout::{NONE, TREE_DEPTH, TRIANGLE_WORDS};
use restir_shared::{pack::xyz, scene::SceneView};
use std::ops::Range;

/// Cost of a leaf, in units of that of a node.
const LEAF_COST: f32 = 1.0;

/// A subtree of the binary tree: a reference as in the arena, and its box.
#[derive(Clone, Copy)]
struct Subtree {
    reference: u32,
    bounds: Bounds,
}

impl Subtree {
    /// Half of the surface of its box.
    fn area(&self) -> f32 {
        let d = self.bounds.hi - self.bounds.lo;
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// The places of its triangles in the order of the binary tree's leaves, if it is one.
    fn places(&self) -> Option<Range<usize>> {
        leaf(self.reference)
    }
}

/// What the best forests of a subtree cost.
#[derive(Clone, Copy)]
struct Best {
    /// Of at most 1, 2, ... roots.
    forest: [f32; WIDTH - 1],
    /// Triangles below it.
    triangles: u32,
    /// Whether as a single root it becomes a leaf.
    is_leaf: bool,
}

/// Where in the wide tree the next node goes: a slot of a node.
type Slot = Option<(usize, usize)>;

struct Collapse<'a> {
    scene: &'a SceneView<'a>,
    binary: &'a Bvh,
    best: Vec<Best>,
}

/// The wide tree of a scene whose triangles a binary tree has by their ids.
pub(super) fn collapse(scene: &SceneView<'_>, binary: &Bvh) -> Tree {
    let tree = Collapse::new(scene, binary).emit(Subtree { reference: binary.root, bounds: binary.bounds });
    assert!(tree.depth <= TREE_DEPTH, "a wide tree is no deeper than the binary one");
    tree
}

impl<'a> Collapse<'a> {
    fn new(scene: &'a SceneView<'a>, binary: &'a Bvh) -> Self {
        let unknown = Best { forest: [0.0; WIDTH - 1], triangles: 0, is_leaf: false };
        let mut this = Self { scene, binary, best: vec![unknown; binary.nodes.len()] };
        // children have larger indices than their parents
        for node in (0..binary.nodes.len()).rev() {
            this.best[node] = this.solve(node as u32);
        }
        this
    }

    fn children(&self, node: u32) -> [Subtree; 2] {
        let of = &self.binary.nodes[node as usize];
        [0, 1].map(|side| {
            let subtree = Subtree { reference: of.children[side], bounds: of.bounds[side] };
            assert!(subtree.places().is_some() || subtree.reference > node, "children come after their parents");
            subtree
        })
    }

    fn best(&self, subtree: &Subtree) -> Best {
        if let Some(places) = subtree.places() {
            let cost = subtree.area() * LEAF_COST;
            return Best { forest: [cost; WIDTH - 1], triangles: places.len() as u32, is_leaf: true };
        }
        self.best[subtree.reference as usize]
    }

    /// Cost of the best forest of at most `roots` roots.
    fn cost(&self, subtree: &Subtree, roots: usize) -> f32 {
        self.best(subtree).forest[roots.min(WIDTH - 1) - 1]
    }

    /// How many of `roots` the first child gets at best, and the cost.
    fn share(&self, [a, b]: &[Subtree; 2], roots: usize) -> (usize, f32) {
        let costs = (1..roots).map(|k| (k, self.cost(a, k) + self.cost(b, roots - k)));
        costs.fold((1, f32::INFINITY), |best, next| if next.1 < best.1 { next } else { best })
    }

    fn solve(&self, node: u32) -> Best {
        let children = self.children(node);
        let [a, b] = &children;
        let area = Subtree { reference: node, bounds: a.bounds.union(b.bounds) }.area();
        let triangles = self.best(a).triangles + self.best(b).triangles;
        let as_node = area + self.share(&children, WIDTH).1;
        let as_leaf = if triangles as usize <= WIDTH { area * LEAF_COST } else { f32::INFINITY };
        let mut forest = [as_node.min(as_leaf); WIDTH - 1];
        for roots in 2..WIDTH {
            forest[roots - 1] = self.share(&children, roots).1.min(forest[roots - 2]);
        }
        Best { forest, triangles, is_leaf: as_leaf <= as_node }
    }

    /// The roots of the best forest.
    fn roots(&self, subtree: Subtree, roots: usize, out: &mut Vec<Subtree>) {
        let cost = self.cost(&subtree, roots);
        if subtree.places().is_some() || cost == self.cost(&subtree, 1) {
            out.push(subtree);
        } else {
            let fewest = (2..roots).find(|&n| self.cost(&subtree, n) == cost).unwrap_or(roots);
            self.split(subtree.reference, fewest, out);
        }
    }

    /// The roots of the best forest of several trees.
    fn split(&self, node: u32, roots: usize, out: &mut Vec<Subtree>) {
        let [a, b] = self.children(node);
        let (k, _) = self.share(&[a, b], roots);
        self.roots(a, k, out);
        self.roots(b, roots - k, out);
    }

    fn emit(&self, root: Subtree) -> Tree {
        // more than enough, so that nothing is ever copied: that would be the peak of memory. What stays unused is only
        // reserved, and given back at the end
        let most = self.best.len() + 1;
        let header = &self.scene.header;
        let mut tree = Tree {
            nodes: Vec::with_capacity(most),
            leaves: Vec::with_capacity(most),
            root: 0,
            partial: false,
            depth: 0,
            bounds: [header.bounds_lo, header.bounds_hi].map(Vec3::from_array),
        };
        let mut work: Vec<(Subtree, Slot, usize)> = vec![(root, None, 0)];
        let mut roots = Vec::with_capacity(WIDTH);
        while let Some((subtree, slot, level)) = work.pop() {
            let reference = if self.best(&subtree).is_leaf {
                let leaf = self.leaf(&subtree);
                tree.partial |= leaf.ids.iter().any(|&id| id != NONE && id & PARTIAL != 0);
                tree.leaves.push(leaf);
                LEAF | (tree.leaves.len() - 1) as u32
            } else {
                roots.clear();
                self.split(subtree.reference, WIDTH, &mut roots);
                let index = tree.nodes.len();
                tree.nodes.push(node(&roots));
                tree.depth = tree.depth.max(level + 1);
                work.extend(roots.iter().enumerate().map(|(i, &child)| (child, Some((index, i)), level + 1)));
                index as u32
            };
            match slot {
                Some((node, slot)) => tree.nodes[node].children[slot] = reference,
                None => tree.root = reference,
            }
        }
        self.mark_emitters(&mut tree);
        tree.nodes.shrink_to_fit();
        tree.leaves.shrink_to_fit();
        tree
    }

    /// Marks the children that have triangles that emit, from the leaves up.
    fn mark_emitters(&self, tree: &mut Tree) {
        let emits = |id: u32| {
            let at = (self.scene.header.triangle_base + (id & !PARTIAL) * TRIANGLE_WORDS) as usize;
            self.scene.geometry[at + 1].w != NONE
        };
        for index in (0..tree.nodes.len()).rev() {
            for (slot, child) in tree.nodes[index].children.into_iter().enumerate().filter(|(_, child)| *child != NONE)
            {
                let is_marked = match child & LEAF {
                    0 => tree.nodes[child as usize].emitters != 0,
                    _ => tree.leaves[(child & !LEAF) as usize].ids.iter().any(|&id| id != NONE && emits(id)),
                };
                tree.nodes[index].emitters |= u32::from(is_marked) << slot;
            }
        }
    }

    /// The triangles of a subtree. Not by recursion, of which rustc 1.95 loses a branch when it optimises.
    fn ids(&self, subtree: &Subtree, out: &mut Vec<u32>) {
        let mut pending = vec![*subtree];
        while let Some(subtree) = pending.pop() {
            if let Some(places) = subtree.places() {
                out.extend(&self.binary.order[places]);
            } else {
                let [a, b] = self.children(subtree.reference);
                pending.extend([b, a]);
            }
        }
    }

    fn leaf(&self, subtree: &Subtree) -> Leaf {
        let mut ids = Vec::with_capacity(WIDTH);
        self.ids(subtree, &mut ids);
        assert!((1..=WIDTH).contains(&ids.len()), "a leaf of {} triangles", ids.len());
        let zero = Array8([0.0; WIDTH]);
        let mut leaf = Leaf { vertices: [[zero; 3]; 3], ids: [NONE; WIDTH] };
        for (lane, &id) in ids.iter().enumerate() {
            let at = (self.scene.header.triangle_base + id * TRIANGLE_WORDS) as usize;
            leaf.ids[lane] = id | self.scene.geometry[at + 2].w & PARTIAL;
            for vertex in 0..3 {
                for (axis, x) in xyz(self.scene.geometry[at + vertex]).to_array().into_iter().enumerate() {
                    leaf.vertices[vertex][axis].0[lane] = x;
                }
            }
        }
        leaf
    }
}

fn node(children: &[Subtree]) -> Node {
    let nowhere = [Array8([f32::INFINITY; WIDTH]), Array8([f32::NEG_INFINITY; WIDTH])];
    let mut node = Node { planes: [nowhere; 3], children: [NONE; WIDTH], emitters: 0 };
    for (slot, child) in children.iter().enumerate() {
        for axis in 0..3 {
            node.planes[axis][0].0[slot] = child.bounds.lo[axis];
            node.planes[axis][1].0[slot] = child.bounds.hi[axis];
        }
    }
    node
}
