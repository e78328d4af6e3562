//! Whether there is any hit, and all hits, once for every [`Lanes`].
//!
//! Whichever hit is found first may end the search, so children wait in no order, and those that the ray passes through come
//! first: where it begins or ends inside the box, as shadow rays do on both of their surfaces, a hit is less likely.

use super::boxes::Boxes;
use super::each::Each;
use super::simd::{LANES, Lanes, lowest};
use super::triangles::{Hits, Triangles};
use super::{Node, Subtree, WideBvh};
use restir_shared::geometry::{Coverage, Crossings, Hit, Ray, Slab};
use restir_shared::lanes::{self, LANES as RAYS};
use restir_shared::layout::STACK_DEPTH;
use std::mem::MaybeUninit;

/// Whether there is a hit that counts with `0 < t < ray.t_max`.
#[inline(always)]
pub(super) fn any<L: Lanes, C: Coverage>(bvh: &WideBvh, ray: &Ray, coverage: &C) -> bool {
    visit(bvh, &prepared::<L>(bvh, ray), ray, |hit, marked| !marked || coverage.covers(ray, hit))
}

/// [`any`] of the rays in `of`, which are prepared together; of others false.
#[inline(always)]
pub(super) fn any_each<L: Lanes, C: Coverage>(
    bvh: &WideBvh,
    rays: &lanes::Lanes<Ray>,
    of: &lanes::Lanes<bool>,
    coverage: &C,
) -> lanes::Lanes<bool> {
    let each = Each::new(rays, bvh.bounds);
    let mut answers = lanes::Lanes::ZERO;
    for at in 0..RAYS {
        if of.get(at) {
            let ray = rays.get(at);
            let covers = |hit: &Hit, marked: bool| !marked || coverage.covers(&ray, hit);
            answers.set(at, visit(bvh, &each.ray::<L>(at), &ray, covers));
        }
    }
    answers
}

#[inline(always)]
fn prepared<L: Lanes>(bvh: &WideBvh, ray: &Ray) -> (Boxes<L>, Triangles<L>) {
    (Boxes::new(&Slab::new(ray, bvh.bounds[0], bvh.bounds[1])), Triangles::new(ray))
}

/// All hits with `0 < t < ray.t_max` for which `coverage` says so, marked or not.
#[inline(always)]
pub(super) fn all<L: Lanes, C: Coverage>(bvh: &WideBvh, ray: &Ray, coverage: &C) -> Crossings {
    let mut crossings = Crossings::NONE;
    visit(bvh, &prepared::<L>(bvh, ray), ray, |hit, _| {
        if coverage.covers(ray, hit) {
            crossings = crossings.with(*hit);
        }
        false
    });
    crossings
}

/// Shows hits with `0 < t < ray.t_max` one by one, each with whether its triangle is marked, until one is `enough`; whether one was.
#[inline(always)]
fn visit<L: Lanes>(
    bvh: &WideBvh,
    (boxes, triangles): &(Boxes<L>, Triangles<L>),
    ray: &Ray,
    mut enough: impl FnMut(&Hit, bool) -> bool,
) -> bool {
    let mut stack = Stack::new();
    let mut current = bvh.root;
    loop {
        match bvh.subtree(current) {
            Subtree::Pack(pack) => {
                let counts = |hits: Hits<L>| {
                    hits.visit(hits.before(ray.t_max), |lane| pack.ids[lane], |_, hit, marked| enough(hit, marked))
                };
                if triangles.hits(pack, boxes).is_some_and(counts) {
                    return true;
                }
            }
            Subtree::Node(node) => {
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
    fn new<L: Lanes>(boxes: &Boxes<L>, node: &Node, t_max: f32) -> Self {
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
    const CAPACITY: usize = STACK_DEPTH * (LANES - 1) + LANES;

    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { waiting: [const { MaybeUninit::uninit() }; Self::CAPACITY], len: 0 }
    }

    /// Pushes the children in `lanes`, the lowest last.
    #[inline(always)]
    pub(super) fn push<L: Lanes>(&mut self, children: &[u32; LANES], lanes: u32) {
        // SAFETY: no node of a `WideBvh` is deeper than `STACK_DEPTH`, so a row is left
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
