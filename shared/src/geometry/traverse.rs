//! Traversal of a binary BVH.

use super::{Coverage, Hit, Ray, Slab, TriangleTest};
use crate::layout::{
    LEAF, LEAF_COUNT_SHIFT, LEAF_MAX_COUNT, MAX_TRIANGLES, NODE_WORDS, NONE, STACK_DEPTH, SceneHeader, TRIANGLE_ALPHA,
};
use crate::pack::xyz;
use glam::{UVec4, Vec3};

/// In the tree and the triangles of the geometry arena `words`: of the hits that count the closest, or with `ANY` some hit, with
/// `0 < t < ray.t_max`; [`Hit::MISS`] if there is none, [`Hit::CUT`] if the device did not let the search end.
pub fn traverse<const ANY: bool, C: Coverage>(words: &[UVec4], header: &SceneHeader, coverage: &C, ray: &Ray) -> Hit {
    let slab = Slab::new(ray, Vec3::from_array(header.bounds_lo), Vec3::from_array(header.bounds_hi));
    let test = TriangleTest::new(ray);
    let mut best = Hit { t: ray.t_max, ..Hit::MISS };
    let mut stack = [NONE; STACK_DEPTH];
    let mut pending = 0;
    let mut current = header.root;
    // its own flag, not `current`: of that a compiler knows the value after the loop
    let mut ended = current == NONE;
    while current != NONE {
        let mut next = NONE;
        if current & LEAF != 0 {
            best = closest_in_leaf(words, header, coverage, ray, &test, &slab, current, best);
        } else {
            let (near, far) = order_children(words, header, &slab, current, best.t);
            next = near;
            if far != NONE && pending < STACK_DEPTH {
                stack[pending] = far;
                pending += 1;
            }
        }
        if ANY && best.id != NONE {
            next = NONE;
            pending = 0;
        }
        if next == NONE && pending > 0 {
            pending -= 1;
            next = stack[pending];
        }
        ended = next == NONE;
        current = next;
    }
    if !ended {
        Hit::CUT
    } else if best.id == NONE {
        Hit::MISS
    } else {
        best
    }
}

#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a structure of references would outlive the optimiser of SPIR-V")]
fn closest_in_leaf<C: Coverage>(
    words: &[UVec4],
    header: &SceneHeader,
    coverage: &C,
    ray: &Ray,
    test: &TriangleTest,
    slab: &Slab,
    leaf: u32,
    mut best: Hit,
) -> Hit {
    let mut id = leaf & (MAX_TRIANGLES - 1);
    let end = id + ((leaf >> LEAF_COUNT_SHIFT) & LEAF_MAX_COUNT);
    while id < end {
        let at = header.triangle_word(id);
        let v0 = xyz(words[at]);
        let v1 = xyz(words[at + 1]);
        let w2 = words[at + 2];
        let hit = test.hit(slab, id, v0, v1, xyz(w2));
        // the limit t_max stands in `best` with the id NONE, which no hit at that t beats
        let nearer = (hit.t < best.t) | ((hit.t == best.t) & (best.id != NONE) & (hit.id < best.id));
        if nearer && (w2.w & TRIANGLE_ALPHA == 0 || coverage.covers(ray, &hit)) {
            best = hit;
        }
        id += 1;
    }
    best
}

/// The children of a node that may hold a hit up to `limit`, the nearer first; [`NONE`] where there is none.
#[inline(always)]
fn order_children(words: &[UVec4], header: &SceneHeader, slab: &Slab, node: u32, limit: f32) -> (u32, u32) {
    let at = (header.node_base + node * NODE_WORDS) as usize;
    let lo0 = words[at];
    let hi0 = words[at + 1];
    let lo1 = words[at + 2];
    let hi1 = words[at + 3];
    let (enter0, exit0) = slab.interval(xyz(lo0), xyz(hi0));
    let (enter1, exit1) = slab.interval(xyz(lo1), xyz(hi1));
    let child0 = if (enter0 <= exit0) & (enter0 <= limit) { lo0.w } else { NONE };
    let child1 = if (enter1 <= exit1) & (enter1 <= limit) { hi0.w } else { NONE };
    if child0 == NONE {
        (child1, NONE)
    } else if child1 == NONE {
        (child0, NONE)
    } else if enter1 < enter0 {
        (child1, child0)
    } else {
        (child0, child1)
    }
}
