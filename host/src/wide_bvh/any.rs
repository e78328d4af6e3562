//! Whether there is any hit, and all hits, once for every [`F32x8`].
//!
//! Whichever hit is found first may end the search, so children wait in no order, and those that the ray passes through come
//! first: where it begins or ends inside the box, as shadow rays do on both of their surfaces, a hit is less likely.

use super::boxes::Boxes;
use super::node::{Child, Node, Tree};
use super::packet::RayPacket16;
use super::simd::{F32x8, WIDTH, lowest};
use super::triangles::{Hits, Triangles};
use restir_shared::geometry::{Coverage, Crossings, Hit, Ray, Slab};
use restir_shared::lanes::{LANES, Lanes};
use restir_shared::layout::TREE_DEPTH;
use std::mem::MaybeUninit;

/// Whether there is a hit that counts with `0 < t < ray.t_max`.
#[inline(always)]
pub(super) fn any<L: F32x8, C: Coverage>(tree: &Tree, ray: &Ray, coverage: &C) -> bool {
    visit(tree, &prepared::<L>(tree, ray), ray, |hit, marked| !marked || coverage.covers(ray, hit))
}

/// [`any`] of the rays in `of`, which are prepared together; of others false.
#[inline(always)]
pub(super) fn any_each<L: F32x8, C: Coverage>(
    tree: &Tree,
    rays: &Lanes<Ray>,
    of: &Lanes<bool>,
    coverage: &C,
) -> Lanes<bool> {
    let each = RayPacket16::new(rays, tree.bounds);
    let mut answers = Lanes::ZERO;
    for at in 0..LANES {
        if of.get(at) {
            let ray = rays.get(at);
            let covers = |hit: &Hit, marked: bool| !marked || coverage.covers(&ray, hit);
            answers.set(at, visit(tree, &each.ray::<L>(at), &ray, covers));
        }
    }
    answers
}

#[inline(always)]
fn prepared<L: F32x8>(tree: &Tree, ray: &Ray) -> (Boxes<L>, Triangles<L>) {
    (Boxes::new(&Slab::new(ray, tree.bounds[0], tree.bounds[1])), Triangles::new(ray))
}

/// All hits with `0 < t < ray.t_max` for which `coverage` says so, marked or not.
#[inline(always)]
pub(super) fn all<L: F32x8, C: Coverage>(tree: &Tree, ray: &Ray, coverage: &C) -> Crossings {
    let mut crossings = Crossings::NONE;
    visit(tree, &prepared::<L>(tree, ray), ray, |hit, _| {
        if coverage.covers(ray, hit) {
            crossings = crossings.with(*hit);
        }
        false
    });
    crossings
}

/// Shows hits with `0 < t < ray.t_max` one by one, each with whether its triangle is marked, until one is `enough`; whether one was.
#[inline(always)]
fn visit<L: F32x8>(
    tree: &Tree,
    (boxes, triangles): &(Boxes<L>, Triangles<L>),
    ray: &Ray,
    mut enough: impl FnMut(&Hit, bool) -> bool,
) -> bool {
    let mut stack = Stack::new();
    let mut current = tree.root;
    loop {
        match tree.child(current) {
            Child::Leaf(leaf) => {
                let counts = |hits: Hits<L>| {
                    hits.visit(hits.before(ray.t_max), |lane| leaf.ids[lane], |_, hit, marked| enough(hit, marked))
                };
                if triangles.hits(leaf, boxes).is_some_and(counts) {
                    return true;
                }
            }
            Child::Node(node) => {
                let Children { hit, through } = Children::new(boxes, node, ray.t_max);
                if hit != 0 {
                    let first = lowest(if through != 0 { through } else { hit });
                    let others = hit & !(1 << first);
                    if others != 0 {
                        stack.push::<L>(&node.children, others & !through);
                        stack.push::<L>(&node.children, others & through);
                    }
                    current = node.children[first];
                    continue;
                }
            }
        }
        current = match stack.pop() {
            Some(next) => next,
            None => return false,
        };
    }
}

/// Children of a node, as bits.
struct Children {
    /// Those that may hold a hit.
    hit: u32,
    /// Those of them whose boxes the ray enters and leaves.
    through: u32,
}

impl Children {
    #[inline(always)]
    fn new<L: F32x8>(boxes: &Boxes<L>, node: &Node, t_max: f32) -> Self {
        let (enter, exit) = boxes.children(node);
        let limit = L::splat(t_max);
        let hit = enter.le(exit.min(limit));
        let through = L::splat(0.0).lt(enter) & exit.lt(limit);
        Self { hit: hit.bits(), through: (hit & through).bits() }
    }
}

/// Subtrees that wait.
pub(super) struct Stack {
    waiting: [MaybeUninit<u32>; Self::CAPACITY],
    len: usize,
}

impl Stack {
    /// All children but one of every node on the longest way from the root, and a row to write into.
    const CAPACITY: usize = TREE_DEPTH * (WIDTH - 1) + WIDTH;

    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { waiting: [const { MaybeUninit::uninit() }; Self::CAPACITY], len: 0 }
    }

    /// Pushes the children in `lanes`, the lowest last.
    #[inline(always)]
    pub(super) fn push<L: F32x8>(&mut self, children: &[u32; WIDTH], lanes: u32) {
        // SAFETY: no node of a `Tree` is deeper than `TREE_DEPTH`, so a row is left
        let free = unsafe { &mut *self.waiting.as_mut_ptr().add(self.len).cast() };
        L::compress(children, lanes, free);
        self.len += lanes.count_ones() as usize;
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<u32> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: words below `len` are written
        Some(unsafe { self.waiting.get_unchecked(self.len).assume_init() })
    }
}
