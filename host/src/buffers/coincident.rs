//! Lamps that lie in other surfaces, which are set apart.
//!
//! Where two surfaces lie in each other, rounding decides which of them a ray meets first. A ray to a point of a lamp ends before either, and so
//! light samples would reach a lamp that scattered rays do not find, and the weights of the two would add up to anything. Each triangle that emits
//! is therefore moved along its normal, by so little that nobody sees it, until every ray can tell it from the surfaces that it lies in:
//!
//! * in front of a surface that does not emit, for a lamp in a ceiling is there to be seen;
//! * in front of lamps that come later in the scene;
//! * behind what lies in front of it already, however near.
//!
//! All techniques then see the same. A triangle that lies in nothing stays where it is.

use super::Flat;
use super::geometry::{self, TRIANGLE};
use crate::bvh::{Bounds, leaf};
use crate::scene::Scene;
use glam::DVec3;
use restir_shared::num::flush;
use std::cmp::Reverse;
use std::collections::{BTreeSet, HashMap};

/// By which part of their largest coordinate two surfaces have to be apart: four times as far as rays begin and end off them.
const APART: f64 = 1.0 / 65_536.0;
/// Nearer than this part of a coordinate, the rounding of four or so, surfaces lie in each other.
const ROUNDING: f64 = 1.0 / 2_097_152.0;
/// Least cosine between the normals of surfaces that lie in each other.
const PARALLEL: f64 = 0.995;
/// Least share of the smaller triangle that lies in the other one: those that meet at an edge have less in common.
const LEAST_SHARE: f64 = 1.0 / 1024.0;

/// What was done to a scene.
#[derive(Debug, Default)]
pub(super) struct Coincident {
    /// The lamps, by their triangles, of which some were moved.
    pub(super) lamps: BTreeSet<usize>,
    /// Lamps and what they lie in, by their instances.
    pub(super) instances: BTreeSet<[u32; 2]>,
}

impl Coincident {
    /// Lamps and what they lie in, by the names of their meshes.
    pub(super) fn names(&self, scene: &Scene) -> Vec<[String; 2]> {
        let name = |instance: u32| scene.meshes[scene.instances[instance as usize].mesh].name.clone();
        let names: BTreeSet<[String; 2]> = self.instances.iter().map(|pair| pair.map(name)).collect();
        names.into_iter().collect()
    }
}

/// Moves the triangles that emit, whose corners are among `corner_words` and lie in the boxes of `node_words`.
pub(super) fn set_apart(
    flat: &Flat,
    node_words: &[u32],
    corner_words: &mut [u32],
    emits: &impl Fn(usize) -> bool,
) -> Coincident {
    let tree = Tree { flat, node_words, corner_words };
    let lamps = (0..flat.triangles.len()).filter(|&index| emits(index));
    let mut lamps: Vec<(usize, Vec<Rival>)> =
        lamps.map(|lamp| (lamp, tree.rivals(lamp, emits))).filter(|(_, rivals)| !rivals.is_empty()).collect();
    // the last ones first: what comes before them in the scene will lie before them in space
    lamps.sort_by_key(|(lamp, _)| Reverse(flat.triangles[*lamp].place()));
    let mut found = Coincident::default();
    let mut shifts = HashMap::new();
    for (lamp, rivals) in &lamps {
        let shift = shift(flat, *lamp, rivals, &shifts);
        shifts.insert(*lamp, shift);
        move_along_normal(&mut corner_words[lamp * TRIANGLE..][..TRIANGLE], shift);
        found.lamps.insert(*lamp);
        let instance = |index: usize| flat.triangles[index].object;
        found.instances.extend(rivals.iter().map(|rival| [instance(*lamp), instance(rival.triangle)]));
    }
    found
}

/// How far a lamp is moved along its normal, where other lamps have been moved already.
fn shift(flat: &Flat, lamp: usize, rivals: &[Rival], shifts: &HashMap<usize, f64>) -> f64 {
    let place = |index: usize| flat.triangles[index].place();
    let (mut forward, mut backward) = (0.0_f64, 0.0_f64);
    for &Rival { triangle, emits, gap, facing, reach } in rivals {
        let apart = APART * reach;
        let gap_now = gap - facing * shifts.get(&triangle).copied().unwrap_or(0.0);
        let tied = gap.abs() <= ROUNDING * reach;
        // of two lamps it is the other one that moves
        let left_to_it = emits && if tied { place(lamp) > place(triangle) } else { gap < 0.0 && facing > 0.0 };
        if left_to_it {
            continue;
        }
        if tied || gap > 0.0 {
            forward = forward.max(apart - gap_now);
        } else {
            backward = backward.min(-apart - gap_now);
        }
    }
    // what is hidden by one surface stays hidden, whatever it hides itself
    if backward < 0.0 { backward } else { forward }
}

/// Moves a triangle, given by its words.
fn move_along_normal(words: &mut [u32], shift: f64) {
    let corners = [0, 4, 8].map(|at| geometry::vector(words, at).as_dvec3());
    let along = Face::new(corners).normal * shift;
    for (at, corner) in [0, 4, 8].into_iter().zip(corners) {
        let moved = (corner + along).to_array().map(|x| flush(x as f32).to_bits());
        words[at..at + 3].copy_from_slice(&moved);
    }
}

/// A triangle that a lamp lies in.
#[derive(Clone, Copy, Debug)]
struct Rival {
    triangle: usize,
    emits: bool,
    /// How far the lamp lies in front of it, along the lamp's normal.
    gap: f64,
    /// 1 if both face the same side, else -1.
    facing: f64,
    /// The largest coordinate of both.
    reach: f64,
}

/// The triangles under their boxes.
struct Tree<'a> {
    flat: &'a Flat,
    node_words: &'a [u32],
    corner_words: &'a [u32],
}

impl Tree<'_> {
    fn rivals(&self, lamp: usize, emits: &impl Fn(usize) -> bool) -> Vec<Rival> {
        let own = self.face(lamp);
        let mut rivals = Vec::new();
        self.visit(&own.bounds(), &mut |triangle| {
            let other = self.face(triangle);
            if triangle != lamp
                && let Some(gap) = own.over(&other)
            {
                let facing = own.normal.dot(other.normal).signum();
                let reach = own.reach().max(other.reach());
                rivals.push(Rival { triangle, emits: emits(triangle), gap, facing, reach });
            }
        });
        rivals
    }

    fn face(&self, triangle: usize) -> Face {
        let at = triangle * TRIANGLE;
        Face::new([0, 4, 8].map(|corner| geometry::vector(self.corner_words, at + corner).as_dvec3()))
    }

    /// Shows the triangles of all leaves whose boxes may come near to these bounds.
    fn visit(&self, bounds: &[DVec3; 2], show: &mut impl FnMut(usize)) {
        let mut pending = vec![self.flat.bvh.root];
        while let Some(reference) = pending.pop() {
            if let Some(triangles) = leaf(reference) {
                triangles.for_each(&mut *show);
                continue;
            }
            let children = self.flat.bvh.nodes[reference as usize].children;
            let boxes = geometry::child_bounds(self.node_words, reference as usize);
            pending
                .extend(children.into_iter().zip(boxes).filter(|(_, of)| is_near(of, bounds)).map(|(child, _)| child));
        }
    }
}

/// Whether a triangle in the box may lie in one of these bounds.
fn is_near(of: &Bounds, [lo, hi]: &[DVec3; 2]) -> bool {
    let (of_lo, of_hi) = (of.lo.as_dvec3(), of.hi.as_dvec3());
    let near =
        APART * [of_lo, of_hi, *lo, *hi].map(|corner| corner.abs().max_element()).into_iter().fold(0.0, f64::max);
    (of_lo - near).cmple(*hi).all() && (*lo - near).cmple(of_hi).all()
}

/// A triangle with its unit normal, which is zero without an area.
struct Face {
    corners: [DVec3; 3],
    normal: DVec3,
    area: f64,
}

impl Face {
    fn new(corners: [DVec3; 3]) -> Self {
        let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        Self { corners, normal: across.normalize_or_zero(), area: 0.5 * across.length() }
    }

    fn bounds(&self) -> [DVec3; 2] {
        let [a, b, c] = self.corners;
        [a.min(b).min(c), a.max(b).max(c)]
    }

    fn reach(&self) -> f64 {
        self.corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f64::max)
    }

    /// How far this lies in front of another one, on average where one lies over the other; `None` unless it lies in it.
    fn over(&self, other: &Face) -> Option<f64> {
        let cosine = self.normal.dot(other.normal).abs();
        if cosine < PARALLEL {
            return None;
        }
        let apart = APART * self.reach().max(other.reach());
        let [a, b, c] = self.corners;
        let height = |p: DVec3| self.normal.dot(a - p);
        let mut common = other.corners.to_vec();
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let inward = self.normal.cross(to - from);
            common = clipped(&common, |p| inward.dot(p - from));
        }
        common = clipped(&common, |p| apart - height(p));
        common = clipped(&common, |p| apart + height(p));
        let share = area(&common) * cosine / self.area.min(other.area * cosine);
        let mean = common.iter().map(|&p| height(p)).sum::<f64>() / common.len() as f64;
        (share > LEAST_SHARE).then_some(mean)
    }
}

/// The part of a convex polygon where `inside` is not negative (Sutherland and Hodgman 1974).
fn clipped(polygon: &[DVec3], inside: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut left = Vec::with_capacity(polygon.len() + 1);
    for (index, &to) in polygon.iter().enumerate() {
        let from = polygon[(index + polygon.len() - 1) % polygon.len()];
        let (before, after) = (inside(from), inside(to));
        if (before < 0.0) != (after < 0.0) {
            left.push(from + (to - from) * (before / (before - after)));
        }
        if after >= 0.0 {
            left.push(to);
        }
    }
    left
}

/// The area of a convex polygon; 0 of none.
fn area(polygon: &[DVec3]) -> f64 {
    let fan = |pair: &[DVec3]| (pair[0] - polygon[0]).cross(pair[1] - polygon[0]);
    0.5 * polygon.windows(2).map(fan).sum::<DVec3>().length()
}
