//! The closest hit, once for every [`F32x8`].

use super::boxes::Boxes;
use super::node::{Child, Node, Tree};
use super::packet::RayPacket16;
use super::simd::{Array8, F32x8, WIDTH, take_lowest};
use super::triangles::Triangles;
use restir_shared::geometry::{Coverage, Hit, Ray, Slab};
use restir_shared::lanes::{LANES, Lanes};
use restir_shared::layout::{NONE, TREE_DEPTH};
use std::mem::MaybeUninit;

/// Of the hits that count the closest with `0 < t < ray.t_max`; [`Hit::MISS`] if there is none.
#[inline(always)]
pub(super) fn closest<L: F32x8, C: Coverage>(tree: &Tree, ray: &Ray, coverage: &C) -> Hit {
    let boxes = Boxes::<L>::new(&Slab::new(ray, tree.bounds[0], tree.bounds[1]));
    traverse(tree, &(boxes, Triangles::<L>::new(ray)), ray, coverage)
}

/// [`closest`] of the rays in `of`, which are prepared together.
#[inline(always)]
pub(super) fn closest_each<L: F32x8, C: Coverage>(
    tree: &Tree,
    rays: &Lanes<Ray>,
    of: &Lanes<bool>,
    coverage: &C,
) -> Lanes<Hit> {
    let each = RayPacket16::new(rays, tree.bounds);
    let mut hits = Lanes::all(Hit::MISS);
    for at in 0..LANES {
        if of.get(at) {
            hits.set(at, traverse(tree, &each.ray::<L>(at), &rays.get(at), coverage));
        }
    }
    hits
}

#[inline(always)]
fn traverse<L: F32x8, C: Coverage>(
    tree: &Tree,
    (boxes, triangles): &(Boxes<L>, Triangles<L>),
    ray: &Ray,
    coverage: &C,
) -> Hit {
    let mut best = Hit { t: ray.t_max, ..Hit::MISS };
    let mut stack = Stack::new();
    let mut current = tree.root;
    loop {
        match tree.child(current) {
            Child::Leaf(leaf) => {
                if let Some(hits) = triangles.hits(leaf, boxes) {
                    hits.visit(
                        hits.up_to(L::splat(best.t)),
                        |lane| leaf.ids[lane],
                        |_, hit, marked| {
                            if is_nearer(hit, &best) && (!marked || coverage.covers(ray, hit)) {
                                best = *hit;
                            }
                            false
                        },
                    );
                }
            }
            Child::Node(node) => {
                let (enter, exit) = boxes.children(node);
                let hit = enter.le(exit.min(L::splat(best.t))).bits();
                if hit != 0 {
                    current = stack.push_all_but_nearest(node, &enter.store(), hit);
                    continue;
                }
            }
        }
        current = match stack.pop(best.t) {
            Some(next) => next,
            None if best.id == NONE => return Hit::MISS,
            None => return best,
        };
    }
}

/// Whether a hit is to take the place of the best one, in which a ray's limit t_max stands with the id [`NONE`]: no hit at that t beats it.
#[inline(always)]
pub(super) fn is_nearer(hit: &Hit, best: &Hit) -> bool {
    (hit.t < best.t) | ((hit.t == best.t) & (best.id != NONE) & (hit.id < best.id))
}

/// Subtrees that wait, each with the distance at which the ray enters it, in the upper half of the word.
pub(super) struct Stack {
    waiting: [MaybeUninit<u64>; Self::CAPACITY],
    len: usize,
}

impl Stack {
    /// All children but one of every node on the longest way from the root, and one more.
    const CAPACITY: usize = TREE_DEPTH * (WIDTH - 1) + 1;

    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { waiting: [const { MaybeUninit::uninit() }; Self::CAPACITY], len: 0 }
    }

    /// The word of a child: distances are not negative, so words are in the order of distances.
    #[inline(always)]
    fn word(node: &Node, enter: &Array8, slot: usize) -> u64 {
        u64::from(enter.0[slot].to_bits()) << 32 | u64::from(node.children[slot])
    }

    #[inline(always)]
    fn push(&mut self, word: u64) {
        // SAFETY: no node of a `Tree` is deeper than `TREE_DEPTH`
        unsafe { self.waiting.get_unchecked_mut(self.len).write(word) };
        self.len += 1;
    }

    /// Inserts into the descending words from `from` on.
    #[inline(always)]
    fn insert(&mut self, from: usize, word: u64) {
        let mut at = self.len;
        self.push(word);
        // SAFETY: words below `len` are written
        unsafe {
            while at > from && self.waiting.get_unchecked(at - 1).assume_init() < word {
                *self.waiting.get_unchecked_mut(at) = *self.waiting.get_unchecked(at - 1);
                at -= 1;
            }
            self.waiting.get_unchecked_mut(at).write(word);
        }
    }

    /// The nearest of the children in `hit`, which is not empty; the others wait, the farthest longest.
    #[inline(always)]
    pub(super) fn push_all_but_nearest(&mut self, node: &Node, enter: &Array8, mut hit: u32) -> u32 {
        let first = take_lowest(&mut hit);
        if hit == 0 {
            return node.children[first];
        }
        let a = Self::word(node, enter, first);
        let b = Self::word(node, enter, take_lowest(&mut hit));
        let from = self.len;
        self.push(a.max(b));
        if hit == 0 {
            return a.min(b) as u32;
        }
        self.push(a.min(b));
        while hit != 0 {
            let slot = take_lowest(&mut hit);
            self.insert(from, Self::word(node, enter, slot));
        }
        self.len -= 1;
        // SAFETY: just written
        unsafe { self.waiting.get_unchecked(self.len).assume_init() as u32 }
    }

    /// The next subtree that the ray enters no later than at `limit`.
    #[inline(always)]
    pub(super) fn pop(&mut self, limit: f32) -> Option<u32> {
        while self.len > 0 {
            self.len -= 1;
            // SAFETY: words below `len` are written
            let word = unsafe { self.waiting.get_unchecked(self.len).assume_init() };
            if f32::from_bits((word >> 32) as u32) <= limit {
                return Some(word as u32);
            }
        }
        None
    }
}
