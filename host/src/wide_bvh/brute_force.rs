//! Scenes of few triangles: sixteen rays by SIMD against each of them, without a tree.
//!
//! Through a tree every ray goes a way of its own, which no processor foresees. Where triangles are few, it takes less time to test them all,
//! with as many rays as a register has lanes. The test is [`TriangleTest`] itself, so that the hits are the same.

use super::node::Leaf;
use glam::Vec3;
use restir_shared::geometry::{Hit, Ray, Slab, TriangleTest};
use restir_shared::lanes::{LANES, LaneKernel, Lanes, SimdToken};
use restir_shared::layout::NONE;
use restir_shared::num;
use restir_shared::vec::{max, min};

/// As many triangles are tested, with all lanes, in the time of one ray through a tree.
const TRIANGLES_A_RAY: usize = 6;

/// All triangles of a scene that has few, by their ids.
#[derive(Debug)]
pub(super) struct BruteForce {
    pub(super) triangles: Vec<Triangle>,
    /// Of the scene.
    bounds: [Vec3; 2],
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    vertices: [Vec3; 3],
    bounds: [Vec3; 2],
    id: u32,
}

impl Triangle {
    fn new(leaf: &Leaf, lane: usize) -> Self {
        let vertices = leaf.vertices.map(|axes| Vec3::from_array(axes.map(|row| row.0[lane])));
        let [a, b, c] = vertices;
        Self { vertices, bounds: [min(min(a, b), c), max(max(a, b), c)], id: leaf.ids[lane] }
    }
}

impl BruteForce {
    /// The triangles of the leaves, none of which is marked, if they are few.
    pub(super) fn new(leaves: &[Leaf], bounds: [Vec3; 2]) -> Option<Self> {
        let most = TRIANGLES_A_RAY * LANES;
        if leaves.len() > most {
            return None;
        }
        let lanes = leaves.iter().flat_map(|leaf| (0..leaf.ids.len()).map(move |lane| Triangle::new(leaf, lane)));
        let mut triangles: Vec<_> = lanes.filter(|triangle| triangle.id != NONE).collect();
        triangles.sort_by_key(|triangle| triangle.id);
        (triangles.len() <= most).then_some(Self { triangles, bounds })
    }

    /// Whether to test all triangles takes less time than as many single rays.
    #[inline(always)]
    pub(super) fn pays(&self, of: &Lanes<bool>) -> bool {
        self.triangles.len() <= TRIANGLES_A_RAY * of.bits().count_ones() as usize
    }

    /// The closest hit of each ray in `of`, in the place of others [`Hit::MISS`].
    #[inline(always)]
    pub(super) fn closest(&self, rays: &Lanes<Ray>, of: &Lanes<bool>, token: impl SimdToken) -> Lanes<Hit> {
        let mut hits = Lanes::ZERO;
        token.run(&Closest(self), &(rays, of), &mut hits);
        hits
    }

    /// Whether each ray in `of` meets a triangle; of others false.
    #[inline(always)]
    pub(super) fn occluded(&self, rays: &Lanes<Ray>, of: &Lanes<bool>, token: impl SimdToken) -> Lanes<bool> {
        let mut answers = Lanes::ZERO;
        token.run(&Occluded(self), &(rays, of), &mut answers);
        answers
    }
}

/// Rays, and for which of them somebody asks.
type Asked<'a> = (&'a Lanes<Ray>, &'a Lanes<bool>);

/// The rays of all lanes, prepared.
struct Prepared {
    slabs: Lanes<Slab>,
    tests: Lanes<TriangleTest>,
    /// At most the distance of [`Hit::MISS`]; zero where nobody asks, so that nothing is hit.
    t_max: Lanes<f32>,
}

impl Prepared {
    #[inline(always)]
    fn new((rays, of): &Asked<'_>, [lo, hi]: [Vec3; 2]) -> Self {
        let mut prepared = Self { slabs: Lanes::ZERO, tests: Lanes::ZERO, t_max: Lanes::ZERO };
        for lane in 0..LANES {
            let ray = rays.get(lane);
            prepared.slabs.set(lane, Slab::new(&ray, lo, hi));
            prepared.tests.set(lane, TriangleTest::new(&ray));
            prepared.t_max.set(lane, if of.get(lane) { num::min(ray.t_max, Ray::FAR) } else { 0.0 });
        }
        prepared
    }

    /// [`TriangleTest::hit`] without branches, which would be wrong half of the time.
    #[inline(always)]
    fn hit(&self, lane: usize, triangle: &Triangle) -> Hit {
        let ([a, b, c], [lo, hi]) = (triangle.vertices, triangle.bounds);
        let crossing = self.tests.get(lane).crossing(a, b, c);
        let hit = crossing.hit(&self.slabs.get(lane), triangle.id, lo, hi);
        if crossing.misses() { Hit::MISS } else { hit }
    }
}

/// Finds the closest hits.
struct Closest<'a>(&'a BruteForce);

impl<'a> LaneKernel for Closest<'a> {
    type In = Asked<'a>;
    type Out = Lanes<Hit>;

    #[inline(always)]
    fn run(&self, asked: &Asked<'a>, hits: &mut Lanes<Hit>) {
        let prepared = Prepared::new(asked, self.0.bounds);
        let mut best = Lanes::<Hit>::all(Hit::MISS);
        let mut limit = prepared.t_max;
        // by their ids, so that the first one of those at the same distance is kept
        for &triangle in &self.0.triangles {
            for lane in 0..LANES {
                let hit = prepared.hit(lane, &triangle);
                let nearer = hit.t < limit.get(lane);
                limit.set(lane, if nearer { hit.t } else { limit.get(lane) });
                best.set(lane, if nearer { hit } else { best.get(lane) });
            }
        }
        *hits = best;
    }
}

/// Finds whether there are any hits.
struct Occluded<'a>(&'a BruteForce);

impl<'a> LaneKernel for Occluded<'a> {
    type In = Asked<'a>;
    type Out = Lanes<bool>;

    #[inline(always)]
    fn run(&self, asked: &Asked<'a>, answers: &mut Lanes<bool>) {
        let prepared = Prepared::new(asked, self.0.bounds);
        let mut nearest = Lanes::<f32>::all(Ray::FAR);
        for &triangle in &self.0.triangles {
            for lane in 0..LANES {
                nearest.set(lane, num::min(prepared.hit(lane, &triangle).t, nearest.get(lane)));
            }
        }
        for lane in 0..LANES {
            answers.set(lane, nearest.get(lane) < prepared.t_max.get(lane));
        }
    }
}
