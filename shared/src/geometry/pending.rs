//! What a traversal has yet to visit: a restart trail, and a ring of the last far children (Laine 2010, "Restart Trail for Stackless BVH
//! Traversal"; Vaidyanathan, Woop and Benthin 2019, "Wide BVH Traversal with a Short Stack").
//!
//! A stack of all that may be pending takes [`TREE_DEPTH`] words, for which some compilers for GPUs use registers. The trail takes a bit a
//! level: whether all is visited there but what lies below. From it alone the way can be found again, from the root. The ring spares that, but
//! for where more far children are pending than it holds.

use super::ring::{Ring, SLOTS, Scratch};
use crate::layout::{NONE, TREE_DEPTH};

/// Nodes pending, and the way to the current one.
pub(super) struct Pending {
    /// Inner nodes on the way to the current one.
    level: u32,
    /// Of their levels those below whose node nothing is pending but what the way leads to.
    settled: Levels,
    /// Of the far children pending those that the ring still holds, the deepest. Each has the slot of its number, counted from the root.
    held: u32,
    ring: Ring,
}

impl Pending {
    /// Nothing pending, at the root.
    #[inline(always)]
    pub(super) fn new(scratch: Scratch) -> Self {
        Self { level: 0, settled: Levels::NONE, held: 0, ring: Ring::new(scratch) }
    }

    /// Which child of an inner node comes next, of those that a hit may lie in, the nearer first; [`NONE`] if there is none. The
    /// other one is pending.
    #[inline(always)]
    pub(super) fn descend(&mut self, near: u32, far: u32) -> u32 {
        // the way leads here a second time, after the nearer child; which is the nearer one does not change, and hits only become fewer
        let again = self.settled.has(self.level);
        if (far != NONE) & !again {
            self.ring.exchange(self.open().count(), far);
            self.held = if self.held < SLOTS { self.held + 1 } else { self.held };
        } else {
            self.settled = self.settled.with(self.level);
        }
        self.level += 1;
        if (far != NONE) & again { far } else { near }
    }

    /// The pending node that is deepest, or the `root`, from which the way leads to it; [`NONE`] if none is pending.
    #[inline(always)]
    pub(super) fn back(&mut self, root: u32) -> u32 {
        let open = self.open();
        if open.is_empty() {
            return NONE;
        }
        let level = open.deepest();
        self.settled = self.settled.with(level).above(level + 1);
        if self.held == 0 {
            self.level = 0;
            return root;
        }
        self.level = level + 1;
        self.held -= 1;
        self.ring.exchange(open.count() - 1, NONE)
    }

    /// The levels with a far child pending.
    #[inline(always)]
    fn open(&self) -> Levels {
        Levels { upper: !self.settled.upper, lower: !self.settled.lower }.above(self.level)
    }
}

/// A set of the tree's levels: a bit each, the root's the highest. No target has to have integers of 64 bits.
#[derive(Clone, Copy)]
struct Levels {
    upper: u32,
    lower: u32,
}

const _: () = assert!(TREE_DEPTH == 64, "a bit a level");

impl Levels {
    const NONE: Self = Self { upper: 0, lower: 0 };

    #[inline(always)]
    fn has(self, level: u32) -> bool {
        let word = if level < 32 { self.upper } else { self.lower };
        word & (HIGHEST >> (level & 31)) != 0
    }

    #[inline(always)]
    fn with(self, level: u32) -> Self {
        let bit = HIGHEST >> (level & 31);
        if level < 32 { Self { upper: self.upper | bit, ..self } } else { Self { lower: self.lower | bit, ..self } }
    }

    /// Those above a level, which is at most [`TREE_DEPTH`].
    #[inline(always)]
    fn above(self, level: u32) -> Self {
        // of the half in which the level lies, it and those below
        let below = !0 >> (level & 31);
        if level < 32 {
            Self { upper: self.upper & !below, lower: 0 }
        } else if level < 64 {
            Self { lower: self.lower & !below, ..self }
        } else {
            self
        }
    }

    #[inline(always)]
    fn is_empty(self) -> bool {
        self.upper | self.lower == 0
    }

    #[inline(always)]
    fn count(self) -> u32 {
        self.upper.count_ones() + self.lower.count_ones()
    }

    /// The deepest level of a set that is not empty.
    #[inline(always)]
    fn deepest(self) -> u32 {
        if self.lower != 0 { 63 - self.lower.trailing_zeros() } else { 31 - self.upper.trailing_zeros() }
    }
}

/// The bit of the root's level.
const HIGHEST: u32 = 1 << 31;

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::layout::LEAF;
    use crate::rng::pcg4d;
    use glam::UVec4;
    use std::vec::Vec;

    /// A tree of boxes along a ray: where each is entered, and the two children of inner nodes; references to leaves are their places.
    struct Tree {
        nodes: Vec<[u32; 2]>,
        enter: Vec<u32>,
        leaves: Vec<u32>,
    }

    impl Tree {
        /// Of so many inner nodes: one below another, or anywhere below those before.
        fn random(count: usize, seed: u32, chain: bool) -> Self {
            let draw = |i: usize| pcg4d(UVec4::new(seed, i as u32, 0, 1));
            let mut tree = Self { nodes: Vec::new(), enter: Vec::new(), leaves: Vec::new() };
            // where there is no child yet: the parent, and which of its children
            let mut open = std::vec![(NONE, 0)];
            for node in 0..count {
                let words = draw(node);
                let place = if chain {
                    open.len() - 1 - (node > 0) as usize * (words.x & 1) as usize
                } else {
                    words.x as usize % open.len()
                };
                let (parent, side) = open.swap_remove(place);
                let above = tree.enter.get(parent as usize).copied().unwrap_or(0);
                tree.nodes.push([NONE; 2]);
                tree.enter.push(above + words.z % 3);
                if parent != NONE {
                    tree.nodes[parent as usize][side] = node as u32;
                }
                open.extend([(node as u32, 0), (node as u32, 1)]);
            }
            for (parent, side) in open {
                let parent = parent as usize;
                tree.nodes[parent][side] = LEAF | tree.leaves.len() as u32;
                tree.leaves.push(tree.enter[parent] + draw(count + 2 * parent + side).x % 5);
            }
            tree
        }

        fn enter(&self, reference: u32) -> u32 {
            if reference & LEAF != 0 {
                self.leaves[(reference & !LEAF) as usize]
            } else {
                self.enter[reference as usize]
            }
        }

        /// The children that are entered up to a limit, the nearer first.
        fn children(&self, node: u32, limit: u32) -> (u32, u32) {
            let [a, b] = self.nodes[node as usize];
            let [a, b] = if self.enter(b) < self.enter(a) { [b, a] } else { [a, b] };
            let within = |child| if self.enter(child) <= limit { child } else { NONE };
            if within(a) == NONE { (within(b), NONE) } else { (a, within(b)) }
        }

        /// The leaves in the order of their visits, each of which lowers the limit to what `hit` gives; and the number of visits.
        fn visits(&self, before: u32, hit: impl Fn(u32) -> u32) -> (Vec<u32>, usize) {
            let (mut pending, mut current, mut limit) = (Pending::new(Scratch { before }), 0, u32::MAX);
            let (mut leaves, mut count) = (Vec::new(), 0);
            while current != NONE {
                count += 1;
                let mut next = NONE;
                if current & LEAF != 0 {
                    leaves.push(current);
                    limit = limit.min(hit(current & !LEAF));
                } else {
                    let (near, far) = self.children(current, limit);
                    next = pending.descend(near, far);
                }
                current = if next == NONE { pending.back(0) } else { next };
            }
            (leaves, count)
        }

        /// The leaves that a stack without an end would visit.
        fn by_stack(&self, hit: impl Fn(u32) -> u32) -> Vec<u32> {
            let (mut stack, mut limit, mut leaves) = (std::vec![0], u32::MAX, Vec::new());
            while let Some(current) = stack.pop() {
                if current & LEAF != 0 {
                    leaves.push(current);
                    limit = limit.min(hit(current & !LEAF));
                } else {
                    let (near, far) = self.children(current, limit);
                    stack.extend([far, near].into_iter().filter(|&child| child != NONE));
                }
            }
            leaves
        }
    }

    fn trees() -> impl Iterator<Item = (u32, Tree)> {
        (0..2000_u32).map(|seed| {
            let chain = seed.is_multiple_of(4);
            let count = if chain { TREE_DEPTH } else { 1 + seed as usize % 40 };
            (seed, Tree::random(count, seed, chain))
        })
    }

    #[test]
    fn all_leaves_are_visited_in_the_order_of_a_stack_and_once() {
        let mut deepest = 0;
        for (seed, tree) in trees() {
            let never = |_| u32::MAX;
            let (leaves, _) = tree.visits(0, never);
            assert_eq!(leaves, tree.by_stack(never), "tree {seed}");
            deepest = deepest.max(leaves.len());
        }
        assert_eq!(deepest, TREE_DEPTH + 1, "chains are as deep as a tree may be");
    }

    /// Whatever the limit is lowered to on the way, no leaf is left out that is entered up to where it ends; and what the ring held before
    /// changes nothing.
    #[test]
    fn leaves_within_the_limit_are_visited_and_what_the_ring_held_does_not_matter() {
        for (seed, tree) in trees() {
            let hit = |leaf| {
                let words = pcg4d(UVec4::new(seed, leaf, 0, 2));
                if words.x.is_multiple_of(3) { tree.leaves[leaf as usize] + words.y % 4 } else { u32::MAX }
            };
            let (visited, count) = tree.visits(0, hit);
            let last = visited.iter().map(|leaf| hit(leaf & !LEAF)).min().unwrap_or(u32::MAX);
            let wanted = (0..tree.leaves.len() as u32).filter(|&leaf| tree.leaves[leaf as usize] <= last);
            for leaf in wanted {
                assert!(visited.contains(&(LEAF | leaf)), "tree {seed}: leaf {leaf} is left out");
            }
            for before in [LEAF, NONE, 7] {
                assert_eq!(tree.visits(before, hit), (visited.clone(), count), "tree {seed}");
            }
        }
    }
}
