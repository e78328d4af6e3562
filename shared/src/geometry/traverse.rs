//! Traversal of a binary BVH.

use super::pending::Pending;
use super::{Coverage, Crossings, Hit, Ray, Scratch, Slab, TriangleTest};
use crate::layout::{
    LEAF, LEAF_COUNT_SHIFT, LEAF_MAX_COUNT, MAX_TRIANGLES, NODE_WORDS, NONE, SceneHeader, TRIANGLE_ALPHA,
};
use crate::pack::xyz;
use glam::{UVec4, Vec3};

/// In the tree and the triangles of the geometry arena `words`: of the hits that count the closest, or with `ANY` some hit, with
/// `0 < t < ray.t_max`; [`Hit::MISS`] if there is none, [`Hit::CUT`] if the device did not let the search end.
pub fn traverse<const ANY: bool, C: Coverage>(
    words: &[UVec4],
    header: &SceneHeader,
    coverage: &C,
    ray: &Ray,
    scratch: Scratch,
) -> Hit {
    let nearest = Nearest::<ANY> { best: Hit { t: ray.t_max, ..Hit::MISS } };
    let (Nearest { best }, ended) = search(words, header, coverage, ray, scratch, nearest);
    if !ended {
        Hit::CUT
    } else if best.id == NONE {
        Hit::MISS
    } else {
        best
    }
}

/// As [`traverse`], all hits of the triangles of one object; [cut](Crossings::is_cut) if the device did not let the search end.
pub fn traverse_all<C: Coverage>(
    words: &[UVec4],
    header: &SceneHeader,
    coverage: &C,
    ray: &Ray,
    object: u32,
    scratch: Scratch,
) -> Crossings {
    let none = Gathered { t_max: ray.t_max, object, crossings: Crossings::none(scratch) };
    let (gathered, ended) = search(words, header, coverage, ray, scratch, none);
    if ended { gathered.crossings } else { gathered.crossings.cut() }
}

/// What a search keeps of the hits that it finds.
trait Keep: Copy {
    /// Whether the triangles of an object are looked at.
    fn asks_for(&self, object: u32) -> bool;
    /// No hit beyond it is kept.
    fn limit(&self) -> f32;
    /// Whether a hit is kept, if it counts.
    fn wants(&self, hit: &Hit) -> bool;
    /// With a hit more.
    #[must_use]
    fn with(self, hit: Hit) -> Self;
    /// Whether nothing more is wanted.
    fn is_full(&self) -> bool;
}

/// The closest hit, or any. The limit t_max stands in it with the id [`NONE`], which no hit at that t beats.
#[derive(Clone, Copy)]
struct Nearest<const ANY: bool> {
    best: Hit,
}

impl<const ANY: bool> Keep for Nearest<ANY> {
    #[inline(always)]
    fn asks_for(&self, _object: u32) -> bool {
        true
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.best.t
    }

    #[inline(always)]
    fn wants(&self, hit: &Hit) -> bool {
        let best = &self.best;
        (hit.t < best.t) | ((hit.t == best.t) & (best.id != NONE) & (hit.id < best.id))
    }

    #[inline(always)]
    fn with(self, hit: Hit) -> Self {
        Self { best: hit }
    }

    #[inline(always)]
    fn is_full(&self) -> bool {
        ANY && self.best.id != NONE
    }
}

/// The crossings of an object that a search has found.
#[derive(Clone, Copy)]
struct Gathered {
    /// Hits have to come before it.
    t_max: f32,
    object: u32,
    crossings: Crossings,
}

impl Keep for Gathered {
    #[inline(always)]
    fn asks_for(&self, object: u32) -> bool {
        object == self.object
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn wants(&self, hit: &Hit) -> bool {
        // a miss is beyond any limit
        (hit.t < self.t_max) & (hit.t < Ray::FAR)
    }

    #[inline(always)]
    fn with(self, hit: Hit) -> Self {
        Self { crossings: self.crossings.with(hit), ..self }
    }

    #[inline(always)]
    fn is_full(&self) -> bool {
        false
    }
}

/// What is kept of the hits that count, and whether the search came to its end.
#[inline(always)]
fn search<K: Keep, C: Coverage>(
    words: &[UVec4],
    header: &SceneHeader,
    coverage: &C,
    ray: &Ray,
    scratch: Scratch,
    mut kept: K,
) -> (K, bool) {
    let slab = Slab::new(ray, Vec3::from_array(header.bounds_lo), Vec3::from_array(header.bounds_hi));
    let test = TriangleTest::new(ray);
    let mut pending = Pending::new(scratch);
    let mut current = header.root;
    // its own flag, not `current`: of that a compiler knows the value after the loop
    let mut ended = current == NONE;
    while current != NONE {
        let mut next = NONE;
        if current & LEAF != 0 {
            kept = search_leaf(words, header, coverage, ray, &test, &slab, current, kept);
        } else {
            let (near, far) = order_children(words, header, &slab, current, kept.limit());
            next = pending.descend(near, far);
        }
        if next == NONE && !kept.is_full() {
            next = pending.back(header.root);
        }
        ended = next == NONE;
        current = next;
    }
    (kept, ended)
}

#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a structure of references would outlive the optimiser of SPIR-V")]
fn search_leaf<K: Keep, C: Coverage>(
    words: &[UVec4],
    header: &SceneHeader,
    coverage: &C,
    ray: &Ray,
    test: &TriangleTest,
    slab: &Slab,
    leaf: u32,
    mut kept: K,
) -> K {
    let mut id = leaf & (MAX_TRIANGLES - 1);
    let end = id + ((leaf >> LEAF_COUNT_SHIFT) & LEAF_MAX_COUNT);
    while id < end {
        let at = header.triangle_word(id);
        let v0 = xyz(words[at]);
        let v1 = xyz(words[at + 1]);
        let w2 = words[at + 2];
        if kept.asks_for(w2.w & !TRIANGLE_ALPHA) {
            let hit = test.hit(slab, id, v0, v1, xyz(w2));
            if kept.wants(&hit) && (w2.w & TRIANGLE_ALPHA == 0 || coverage.covers(ray, &hit)) {
                kept = kept.with(hit);
            }
        }
        id += 1;
    }
    kept
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
