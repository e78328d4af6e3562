//! The closest hits of rays that have most of their way in common, as those through a pixel have, once for every [`F32x8`].
//!
//! The tree is traversed once for all of them. A [`Beam`] holds, of each number of their [`Slab`](restir_shared::geometry::Slab)s, the least and the greatest one, and
//! as rounded differences and products are monotone, it enters a box no later and leaves it no earlier than any of the rays. What it
//! passes by none of them hits; what is left is tested as for a single ray.

use super::any;
use super::boxes::{Boxes, interval, sign};
use super::closest::{Stack, is_nearer};
use super::node::{Child, Leaf, Node, One, Tree, Vertices};
use super::packet::{HALVES, Numbers, RayPacket16};
use super::simd::{Array8, F32x8, WIDTH, take_lowest};
use super::triangles::Triangles;
use restir_shared::geometry::{Coverage, Hit, Ray};
use restir_shared::lanes::{LANES, Lanes};
use restir_shared::num;

/// What [`closest`](super::closest::closest) finds for each ray.
#[inline(always)]
pub(super) fn closest<L: F32x8, C: Coverage>(tree: &Tree, rays: &Lanes<Ray>, coverage: &C) -> Lanes<Hit> {
    let each = RayPacket16::new(rays, tree.bounds);
    let Some(order) = each.order() else {
        return super::closest::closest_each::<L, C>(tree, rays, &Lanes::all(true), coverage);
    };
    let beam = Beam::<L>::new(&each);
    traverse::<L, C, false>(tree, &beam, &each, order, rays, coverage)
}

/// The closest hits of rays that `beam` bounds and whose axes all have the order `order`. With `EMITTERS` it tests only the leaves that hold a
/// triangle that emits, each of their triangles included.
#[inline(always)]
pub(super) fn traverse<L: F32x8, C: Coverage, const EMITTERS: bool>(
    tree: &Tree,
    beam: &Beam<L>,
    each: &RayPacket16,
    order: [usize; 3],
    rays: &Lanes<Ray>,
    coverage: &C,
) -> Lanes<Hit> {
    let halves = [each.half::<L>(order, 0), each.half::<L>(order, 1)];
    let mut found = Found::new::<L>(each.t_max);
    let mut stack = Stack::new();
    let mut current = tree.root;
    loop {
        match tree.child(current) {
            Child::Leaf(leaf) => {
                let mut lanes = beam.meets(leaf, found.limit);
                while lanes != 0 {
                    let lane = take_lowest(&mut lanes);
                    for (half, of_half) in halves.iter().enumerate() {
                        found.look::<L, C>(of_half, half, (leaf, lane), rays, coverage);
                    }
                }
            }
            Child::Node(node) => {
                let (enter, exit) = beam.children(node);
                let near = enter.le(exit.min(L::splat(found.limit))).bits();
                let hit = if EMITTERS { near & node.emitters } else { near };
                if hit != 0 {
                    current = stack.push_all_but_nearest(node, &enter.store(), hit);
                    continue;
                }
            }
        }
        current = match stack.pop(found.limit) {
            Some(next) => next,
            None => return found.hits(),
        };
    }
}

/// Whether one of the rays meets a triangle of a leaf that holds one that emits, be it behind others. The answer is yes without a test, if the
/// orders of the rays' axes differ.
#[inline(always)]
pub(super) fn may_meet_emitters<L: F32x8, C: Coverage>(tree: &Tree, rays: &Lanes<Ray>, coverage: &C) -> bool {
    let each = RayPacket16::new(rays, tree.bounds);
    let Some(order) = each.order() else { return true };
    let beam = Beam::<L>::new(&each);
    let hits = traverse::<L, C, true>(tree, &beam, &each, order, rays, coverage);
    (0..LANES).any(|at| hits.get(at).is_hit())
}

/// Whether a ray between these may meet a triangle that emits: whether the beam of all enters the box of one, or of one that shares its leaf.
#[inline(always)]
pub(super) fn emitters_between<L: F32x8, C: Coverage>(tree: &Tree, rays: &Lanes<Ray>, _: &C) -> bool {
    let each = RayPacket16::new(rays, tree.bounds);
    let (beam, limit) = (Beam::<L>::new(&each), greatest::<L>(&each.t_max));
    let mut stack = any::Stack::new();
    let mut current = tree.root;
    loop {
        match tree.child(current) {
            Child::Leaf(leaf) => {
                if beam.meets(leaf, limit) != 0 {
                    return true;
                }
            }
            Child::Node(node) => {
                let (enter, exit) = beam.children(node);
                let hit = enter.le(exit.min(L::splat(limit))).bits();
                stack.push::<L>(&node.children, hit & node.emitters);
            }
        }
        current = match stack.pop() {
            Some(next) => next,
            None => return false,
        };
    }
}

#[inline(always)]
fn least<L: F32x8>(numbers: &Numbers) -> f32 {
    let row = L::load(&numbers[0]).min(L::load(&numbers[1])).store().0;
    row.into_iter().fold(row[0], num::min)
}

#[inline(always)]
fn greatest<L: F32x8>(numbers: &Numbers) -> f32 {
    let row = L::load(&numbers[0]).max(L::load(&numbers[1])).store().0;
    row.into_iter().fold(row[0], num::max)
}

/// What bounds the slabs of all rays.
pub(super) struct Beam<L> {
    /// What is subtracted from the nearer and from the farther planes, by axis.
    origins: [[L; 2]; 3],
    /// The least and the greatest reciprocal.
    inverse: [[L; 2]; 3],
    /// 1 where the directions are negative, so that the upper plane is the nearer one.
    near: [usize; 3],
}

impl<L: F32x8> Beam<L> {
    #[inline(always)]
    pub(super) fn new(each: &RayPacket16) -> Self {
        let mut beam = Self { origins: [[L::splat(0.0); 2]; 3], inverse: [[L::splat(1.0); 2]; 3], near: [0; 3] };
        for axis in 0..3 {
            let (lower, upper) = (greatest::<L>(&each.lo_origin[axis]), least::<L>(&each.hi_origin[axis]));
            let inverse = [least::<L>(&each.inverse[axis]), greatest::<L>(&each.inverse[axis])];
            let upper_is_near = sign(inverse[0]);
            let [near, far] = if upper_is_near != sign(inverse[1]) {
                // rays that go both ways are everywhere along the axis
                [f32::MAX, -f32::MAX]
            } else {
                beam.inverse[axis] = [L::splat(inverse[0]), L::splat(inverse[1])];
                beam.near[axis] = upper_is_near;
                if upper_is_near == 0 { [lower, upper] } else { [upper, lower] }
            };
            beam.origins[axis] = [L::splat(near), L::splat(far)];
        }
        beam
    }

    /// The distances at which the first ray enters the children, and the last one leaves them.
    #[inline(always)]
    fn children(&self, node: &Node) -> (L, L) {
        let [x, y, z] = &node.planes;
        interval([self.along(0, load(x)), self.along(1, load(y)), self.along(2, load(z))])
    }

    /// Of a leaf, the triangles that a ray may hit up to `limit`.
    #[inline(always)]
    fn meets(&self, leaf: &Leaf, limit: f32) -> u32 {
        let along = [self.along(0, leaf.bounds(0)), self.along(1, leaf.bounds(1)), self.along(2, leaf.bounds(2))];
        let (enter, exit) = interval(along);
        enter.le(exit.min(L::splat(limit))).bits()
    }

    /// Where the rays are between lower and upper planes.
    #[inline(always)]
    fn along(&self, axis: usize, planes: [L; 2]) -> [L; 2] {
        let (near, [least, greatest]) = (self.near[axis] & 1, self.inverse[axis]);
        let (to_near, to_far) = (planes[near] - self.origins[axis][0], planes[near ^ 1] - self.origins[axis][1]);
        [(to_near * least).min(to_near * greatest), (to_far * least).max(to_far * greatest)]
    }
}

#[inline(always)]
fn load<L: F32x8>(planes: &[Array8; 2]) -> [L; 2] {
    [L::load(&planes[0]), L::load(&planes[1])]
}

/// The best hits so far.
struct Found {
    hits: [Hit; LANES],
    /// Their distances.
    t: Numbers,
    /// The greatest of these.
    limit: f32,
}

impl Found {
    #[inline(always)]
    fn new<L: F32x8>(t_max: Numbers) -> Self {
        let mut hits = [Hit::MISS; LANES];
        for half in 0..HALVES {
            for lane in 0..WIDTH {
                hits[half * WIDTH + lane].t = t_max[half].0[lane];
            }
        }
        Self { hits, t: t_max, limit: greatest::<L>(&t_max) }
    }

    /// Tests a triangle of a leaf against the rays of a half.
    #[inline(always)]
    fn look<L: F32x8, C: Coverage>(
        &mut self,
        (boxes, triangles): &(Boxes<L>, Triangles<L>),
        half: usize,
        (leaf, triangle): (&Leaf, usize),
        rays: &Lanes<Ray>,
        coverage: &C,
    ) {
        if let Some(hits) = triangles.hits(One(leaf, triangle), boxes) {
            let lanes = hits.up_to(L::load(&self.t[half]));
            hits.visit(
                lanes,
                |_| leaf.ids[triangle],
                |lane, hit, marked| {
                    let at = half * WIDTH + lane;
                    if is_nearer(hit, &self.hits[at]) && (!marked || coverage.covers(&rays.get(at), hit)) {
                        self.hits[at] = *hit;
                        self.t[half].0[lane] = hit.t;
                    }
                    false
                },
            );
            self.limit = greatest::<L>(&self.t);
        }
    }

    #[inline(always)]
    fn hits(&self) -> Lanes<Hit> {
        Lanes::from_fn(|at| if self.hits[at].is_hit() { self.hits[at] } else { Hit::MISS })
    }
}
