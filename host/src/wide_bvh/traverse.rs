//! Traversal, once for every [`Lanes`].

use super::simd::{LANES, Lanes, Row};
use super::{Node, PACK, PARTIAL, Pack, WideBvh};
use glam::{Vec2, Vec3};
use restir_shared::geometry::{Coverage, Hit, Ray, Slab};
use restir_shared::layout::{NONE, STACK_DEPTH};
use restir_shared::num;
use std::mem::MaybeUninit;

/// [`traverse`] with 256-bit registers.
///
/// # Safety
/// The processor has AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
pub(super) unsafe fn traverse_avx2<const ANY: bool, C: Coverage>(bvh: &WideBvh, ray: &Ray, coverage: &C) -> Hit {
    traverse::<super::simd::Avx2, ANY, C>(bvh, ray, coverage)
}

/// Of the hits that count the closest, or with `ANY` some hit, with `0 < t < ray.t_max`; [`Hit::MISS`] if there is none.
#[inline(always)]
pub(super) fn traverse<L: Lanes, const ANY: bool, C: Coverage>(bvh: &WideBvh, ray: &Ray, coverage: &C) -> Hit {
    let boxes = Boxes::<L>::new(&Slab::new(ray, bvh.bounds[0], bvh.bounds[1]));
    let triangles = Triangles::<L>::new(ray);
    let mut best = Hit { t: ray.t_max, ..Hit::MISS };
    let mut stack = Stack::new();
    let mut current = bvh.root;
    loop {
        if current & PACK != 0 {
            // SAFETY: references of a `WideBvh` are indices of its packs and nodes
            let pack = unsafe { bvh.packs.get_unchecked((current & !PACK) as usize) };
            triangles.closest(pack, &boxes, |hit| coverage.covers(ray, hit), &mut best);
            if ANY && best.id != NONE {
                return best;
            }
        } else {
            // SAFETY: as above
            let node = unsafe { bvh.nodes.get_unchecked(current as usize) };
            let (enter, hit) = boxes.children(node, best.t);
            if hit != 0 {
                current = stack.push_all_but_nearest(node, &enter, hit);
                continue;
            }
        }
        current = match stack.pop(best.t) {
            Some(next) => next,
            None if best.id == NONE => return Hit::MISS,
            None => return best,
        };
    }
}

/// Subtrees that wait, each with the distance at which the ray enters it, in the upper half of the word.
struct Stack {
    waiting: [MaybeUninit<u64>; Self::CAPACITY],
    len: usize,
}

impl Stack {
    /// All children but one of every node on the longest way from the root, and one more.
    const CAPACITY: usize = STACK_DEPTH * (LANES - 1) + 1;

    #[inline(always)]
    fn new() -> Self {
        Self { waiting: [const { MaybeUninit::uninit() }; Self::CAPACITY], len: 0 }
    }

    /// The word of a child: distances are not negative, so words are in the order of distances.
    #[inline(always)]
    fn word(node: &Node, enter: &Row, slot: usize) -> u64 {
        u64::from(enter.0[slot].to_bits()) << 32 | u64::from(node.children[slot])
    }

    #[inline(always)]
    fn push(&mut self, word: u64) {
        // SAFETY: no node of a `WideBvh` is deeper than `STACK_DEPTH`
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
    fn push_all_but_nearest(&mut self, node: &Node, enter: &Row, mut hit: u32) -> u32 {
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
    fn pop(&mut self, limit: f32) -> Option<u32> {
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

/// Takes the lowest of the bits, which are not all zero.
#[inline(always)]
fn take_lowest(bits: &mut u32) -> usize {
    let lowest = bits.trailing_zeros() as usize;
    *bits &= bits.wrapping_sub(1);
    // shows the compiler that it is a lane
    lowest & (LANES - 1)
}

/// [`Slab`] in every lane.
struct Boxes<L> {
    /// What is subtracted from lower and upper planes, by axis.
    origins: [[L; 2]; 3],
    inverse: [L; 3],
    /// 1 where the direction is negative, so that the upper plane is the nearer one.
    near: [usize; 3],
}

impl<L: Lanes> Boxes<L> {
    #[inline(always)]
    fn new(slab: &Slab) -> Self {
        let (lo, hi, inverse) = (slab.lo_origin, slab.hi_origin, slab.inverse);
        let pair = |lo, hi| [L::splat(lo), L::splat(hi)];
        Self {
            origins: [pair(lo.x, hi.x), pair(lo.y, hi.y), pair(lo.z, hi.z)],
            inverse: splat(inverse),
            near: [sign(inverse.x), sign(inverse.y), sign(inverse.z)],
        }
    }

    /// Distances to lower (0) or upper (1) planes.
    #[inline(always)]
    fn distance(&self, axis: usize, side: usize, planes: L) -> L {
        (planes - self.origins[axis][side]) * self.inverse[axis]
    }

    /// The distances at which the ray enters the children, and which of them may hold a hit up to `limit`.
    ///
    /// It is [`Slab::interval`]: which of a slab's two distances is the smaller is known beforehand, because the
    /// rounded difference and product are monotone.
    #[inline(always)]
    fn children(&self, node: &Node, limit: f32) -> (Row, u32) {
        let (enter, exit) = interval([self.slab(node, 0), self.slab(node, 1), self.slab(node, 2)]);
        (enter.store(), enter.le(exit.min(L::splat(limit))).bits())
    }

    #[inline(always)]
    fn slab(&self, node: &Node, axis: usize) -> [L; 2] {
        // `& 1` shows the compiler that it is an index
        let near = self.near[axis] & 1;
        let far = near ^ 1;
        let planes = &node.planes[axis];
        [self.distance(axis, near, L::load(&planes[near])), self.distance(axis, far, L::load(&planes[far]))]
    }

    /// [`Slab::interval`] of the triangles' bounds.
    #[inline(always)]
    fn bounds(&self, pack: &Pack) -> (L, L) {
        interval([self.bounds_along(pack, 0), self.bounds_along(pack, 1), self.bounds_along(pack, 2)])
    }

    #[inline(always)]
    fn bounds_along(&self, pack: &Pack, axis: usize) -> [L; 2] {
        let a = L::load(&pack.vertices[0][axis]);
        let b = L::load(&pack.vertices[1][axis]);
        let c = L::load(&pack.vertices[2][axis]);
        let lower = self.distance(axis, 0, a.min(b).min(c));
        let upper = self.distance(axis, 1, a.max(b).max(c));
        [lower.min(upper), lower.max(upper)]
    }
}

/// Where a ray is in three slabs.
#[inline(always)]
fn interval<L: Lanes>([x, y, z]: [[L; 2]; 3]) -> (L, L) {
    (x[0].max(y[0]).max(z[0].max(L::splat(0.0))), x[1].min(y[1]).min(z[1]))
}

#[inline(always)]
fn sign(x: f32) -> usize {
    (x.to_bits() >> 31) as usize
}

/// [`TriangleTest`](restir_shared::geometry::TriangleTest) in every lane.
struct Triangles<L> {
    /// The axes in the order of the test's x, y, z.
    axes: [usize; 3],
    /// By the scene's axes.
    origin: [L; 3],
    shear_x: L,
    shear_y: L,
    scale: L,
}

/// Cyclic orders of the axes, by the one that is last.
static ROTATIONS: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

impl<L: Lanes> Triangles<L> {
    /// `TriangleTest::new` without branches: which axis is the largest is hard to predict.
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let d = ray.direction.to_array();
        let [x, y, z] = [num::abs(d[0]), num::abs(d[1]), num::abs(d[2])];
        let is_x = usize::from((x > y) & (x > z));
        let is_y = usize::from(y > z) & (1 - is_x);
        let axes = ROTATIONS[2 - 2 * is_x - is_y];
        let scale = num::recip(d[axes[2]]);
        Self {
            axes,
            origin: splat(ray.origin),
            shear_x: L::splat(d[axes[0]] * scale),
            shear_y: L::splat(d[axes[1]] * scale),
            scale: L::splat(scale),
        }
    }

    /// Vertices in sheared coordinates, but for the scale of z.
    #[inline(always)]
    fn shear(&self, vertices: &[Row; 3]) -> [L; 3] {
        let [x, y, z] = self.axes;
        let (x, y, z) = (self.relative(vertices, x), self.relative(vertices, y), self.relative(vertices, z));
        [x - self.shear_x * z, y - self.shear_y * z, z]
    }

    #[inline(always)]
    fn relative(&self, vertices: &[Row; 3], axis: usize) -> L {
        L::load(&vertices[axis]) - self.origin[axis]
    }

    /// `TriangleTest::hit` of all triangles of the pack, into the closest hit so far; of marked ones where `covers` says so.
    #[inline(always)]
    fn closest(&self, pack: &Pack, boxes: &Boxes<L>, covers: impl Fn(&Hit) -> bool, best: &mut Hit) {
        let zero = L::splat(0.0);
        let a = self.shear(&pack.vertices[0]);
        let b = self.shear(&pack.vertices[1]);
        let c = self.shear(&pack.vertices[2]);
        let u = flush(c[0] * b[1] - c[1] * b[0]);
        let v = flush(a[0] * c[1] - a[1] * c[0]);
        let w = flush(b[0] * a[1] - b[1] * a[0]);
        let front = zero.le(u) & zero.le(v) & zero.le(w);
        let back = u.le(zero) & v.le(zero) & w.le(zero);
        let det = u + v + w;
        let inside = (front | back) & (det.lt(zero) | zero.lt(det));
        if inside.bits() == 0 {
            return;
        }
        let inv = L::splat(1.0) / det;
        let t = (u * (a[2] * self.scale) + v * (b[2] * self.scale) + w * (c[2] * self.scale)) * inv;
        let (t0, t1) = boxes.bounds(pack);
        let t = t.min(t1).max(t0);
        let mut hits = (inside & t0.le(t1) & zero.lt(t) & t.le(L::splat(best.t))).bits();
        if hits == 0 {
            return;
        }
        let (t, v, w) = (t.store(), (v * inv).store(), (w * inv).store());
        while hits != 0 {
            let lane = take_lowest(&mut hits);
            let marked = pack.ids[lane] & PARTIAL != 0;
            let hit = Hit { t: t.0[lane], id: pack.ids[lane] & !PARTIAL, uv: Vec2::new(v.0[lane], w.0[lane]) };
            // the limit t_max stands in `best` with the id NONE, which no hit at that t beats
            let nearer = (hit.t < best.t) | ((hit.t == best.t) & (best.id != NONE) & (hit.id < best.id));
            if nearer && (!marked || covers(&hit)) {
                *best = hit;
            }
        }
    }
}

#[inline(always)]
fn splat<L: Lanes>(v: Vec3) -> [L; 3] {
    [L::splat(v.x), L::splat(v.y), L::splat(v.z)]
}

/// [`num::flush`].
#[inline(always)]
fn flush<L: Lanes>(x: L) -> L {
    let magnitude = x & L::splat(f32::from_bits(0x7fff_ffff));
    x.unless(magnitude.lt(L::splat(num::FLUSH_BELOW)))
}
