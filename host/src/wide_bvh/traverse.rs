//! Traversal, once for every [`Lanes`].

use super::simd::{LANES, Lanes, Row};
use super::{Node, PACK, Pack, WideBvh};
use glam::{Vec2, Vec3};
use restir_shared::geometry::{Hit, Ray, Slab, TriangleTest};
use restir_shared::layout::{NONE, STACK_DEPTH};
use restir_shared::num;
use std::mem::MaybeUninit;

/// [`traverse`] with 256-bit registers.
///
/// # Safety
/// The processor has AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
pub(super) unsafe fn traverse_avx2<const ANY: bool>(bvh: &WideBvh, ray: &Ray) -> Hit {
    traverse::<super::simd::Avx2, ANY>(bvh, ray)
}

/// The closest hit, or with `ANY` some hit, with `0 < t < ray.t_max`; [`Hit::MISS`] if there is none.
#[inline(always)]
pub(super) fn traverse<L: Lanes, const ANY: bool>(bvh: &WideBvh, ray: &Ray) -> Hit {
    let boxes = Boxes::<L>::new(&Slab::new(ray, bvh.bounds[0], bvh.bounds[1]));
    let triangles = Triangles::<L>::new(&TriangleTest::new(ray));
    let mut best = Hit { t: ray.t_max, ..Hit::MISS };
    let mut stack = Stack::new();
    let mut current = bvh.root;
    loop {
        if current & PACK != 0 {
            // SAFETY: references of a `WideBvh` are indices of its packs and nodes
            let pack = unsafe { bvh.packs.get_unchecked((current & !PACK) as usize) };
            triangles.closest(pack, &boxes, &mut best);
            if ANY && best.id != NONE {
                return best;
            }
        } else {
            // SAFETY: as above
            let node = unsafe { bvh.nodes.get_unchecked(current as usize) };
            let (enter, hit) = boxes.test(node, best.t);
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
        Self { waiting: [MaybeUninit::uninit(); Self::CAPACITY], len: 0 }
    }

    /// The word of a child: distances are not negative, so words are in the order of distances.
    #[inline(always)]
    fn word(node: &Node, enter: &Row, slot: usize) -> u64 {
        u64::from(enter.0[slot].to_bits()) << 32 | u64::from(node.children[slot])
    }

    /// Inserts into the descending words from `from` on.
    #[inline(always)]
    fn insert(&mut self, from: usize, word: u64) {
        // SAFETY: no node of a `WideBvh` is deeper than `STACK_DEPTH`, and words below `len` are written
        unsafe {
            let mut at = self.len;
            while at > from && self.waiting.get_unchecked(at - 1).assume_init() < word {
                *self.waiting.get_unchecked_mut(at) = *self.waiting.get_unchecked(at - 1);
                at -= 1;
            }
            self.waiting.get_unchecked_mut(at).write(word);
        }
        self.len += 1;
    }

    /// The nearest of the children in `hit`; the others wait, the farthest longest.
    #[inline(always)]
    fn push_all_but_nearest(&mut self, node: &Node, enter: &Row, mut hit: u32) -> u32 {
        let first = hit.trailing_zeros() as usize;
        hit &= hit - 1;
        if hit == 0 {
            return node.children[first & (LANES - 1)];
        }
        let from = self.len;
        self.insert(from, Self::word(node, enter, first & (LANES - 1)));
        while hit != 0 {
            let slot = hit.trailing_zeros() as usize & (LANES - 1);
            self.insert(from, Self::word(node, enter, slot));
            hit &= hit - 1;
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

/// The planes of eight boxes: for each axis the lower and the upper ones.
type Planes<L> = [[L; 2]; 3];

/// [`Slab`] in every lane.
struct Boxes<L> {
    /// Whether the upper plane is the nearer one, by axis.
    flipped: [bool; 3],
    near_origin: [L; 3],
    far_origin: [L; 3],
    inverse: [L; 3],
}

impl<L: Lanes> Boxes<L> {
    #[inline(always)]
    fn new(slab: &Slab) -> Self {
        let flipped = slab.inverse.cmplt(Vec3::ZERO);
        let near = Vec3::select(flipped, slab.hi_origin, slab.lo_origin);
        let far = Vec3::select(flipped, slab.lo_origin, slab.hi_origin);
        Self {
            flipped: flipped.into(),
            near_origin: splat(near),
            far_origin: splat(far),
            inverse: splat(slab.inverse),
        }
    }

    /// Distances to the nearer planes of an axis, from the lower and the upper ones.
    #[inline(always)]
    fn near(&self, axis: usize, [lo, hi]: [L; 2]) -> L {
        let plane = if self.flipped[axis] { hi } else { lo };
        (plane - self.near_origin[axis]) * self.inverse[axis]
    }

    /// Distances to the farther planes of an axis.
    #[inline(always)]
    fn far(&self, axis: usize, [lo, hi]: [L; 2]) -> L {
        let plane = if self.flipped[axis] { lo } else { hi };
        (plane - self.far_origin[axis]) * self.inverse[axis]
    }

    /// [`Slab::interval`]. Which of a slab's two distances is the smaller is known beforehand, because the rounded
    /// difference and product are monotone.
    #[inline(always)]
    fn interval(&self, [x, y, z]: Planes<L>) -> (L, L) {
        let enter = self.near(0, x).max(self.near(1, y)).max(self.near(2, z).max(L::splat(0.0)));
        let exit = self.far(0, x).min(self.far(1, y)).min(self.far(2, z));
        (enter, exit)
    }

    /// The distances at which the ray enters the children, and which of them may hold a hit up to `limit`.
    #[inline(always)]
    fn test(&self, node: &Node, limit: f32) -> (Row, u32) {
        let [x, y, z] = &node.planes;
        let (enter, exit) = self.interval([load_pair(x), load_pair(y), load_pair(z)]);
        (enter.store(), enter.le(exit.min(L::splat(limit))).bits())
    }
}

/// [`TriangleTest`] in every lane.
struct Triangles<L> {
    /// The axes in the order of the test's x, y, z.
    axes: [usize; 3],
    origin: [L; 3],
    shear_x: L,
    shear_y: L,
    scale: L,
}

impl<L: Lanes> Triangles<L> {
    #[inline(always)]
    fn new(test: &TriangleTest) -> Self {
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][test.axis.min(2) as usize];
        Self {
            axes,
            origin: splat(test.origin),
            shear_x: L::splat(test.shear_x),
            shear_y: L::splat(test.shear_y),
            scale: L::splat(test.scale),
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

    /// [`TriangleTest::hit`] of all triangles of the pack, into the closest hit so far.
    #[inline(always)]
    fn closest(&self, pack: &Pack, boxes: &Boxes<L>, best: &mut Hit) {
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
        let (t0, t1) = boxes.interval([bounds(pack, 0), bounds(pack, 1), bounds(pack, 2)]);
        let t = t.min(t1).max(t0);
        let mut hits = (inside & t0.le(t1) & zero.lt(t) & t.le(L::splat(best.t))).bits();
        if hits == 0 {
            return;
        }
        let (t, v, w) = (t.store(), (v * inv).store(), (w * inv).store());
        while hits != 0 {
            let lane = hits.trailing_zeros() as usize & (LANES - 1);
            let (t, id) = (t.0[lane], pack.ids[lane]);
            // the limit t_max stands in `best` with the id NONE, which no hit at that t beats
            if (t < best.t) | ((t == best.t) & (best.id != NONE) & (id < best.id)) {
                *best = Hit { t, id, uv: Vec2::new(v.0[lane], w.0[lane]) };
            }
            hits &= hits - 1;
        }
    }
}

#[inline(always)]
fn splat<L: Lanes>(v: Vec3) -> [L; 3] {
    [L::splat(v.x), L::splat(v.y), L::splat(v.z)]
}

#[inline(always)]
fn load_pair<L: Lanes>([lo, hi]: &[Row; 2]) -> [L; 2] {
    [L::load(lo), L::load(hi)]
}

/// The bounds of the triangles along an axis.
#[inline(always)]
fn bounds<L: Lanes>(pack: &Pack, axis: usize) -> [L; 2] {
    let a = L::load(&pack.vertices[0][axis]);
    let b = L::load(&pack.vertices[1][axis]);
    let c = L::load(&pack.vertices[2][axis]);
    [a.min(b).min(c), a.max(b).max(c)]
}

/// [`num::flush`].
#[inline(always)]
fn flush<L: Lanes>(x: L) -> L {
    let magnitude = x & L::splat(f32::from_bits(0x7fff_ffff));
    x.unless(magnitude.lt(L::splat(num::FLUSH_BELOW)))
}
