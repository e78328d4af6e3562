//! Lamps that lie in other surfaces, which are set apart.
//!
//! Where two surfaces lie in each other, rounding decides which of them a ray meets first. A ray to a point of a lamp ends before either, and so
//! light samples would reach a lamp that scattered rays do not find, and the weights of the two would add up to anything. Each triangle that emits
//! is therefore moved along its normal, by so little that nobody sees it, until rays can tell it from the surfaces that it lies in. It comes to lie
//!
//! * in front of a surface that does not emit, for a lamp in a ceiling is there to be seen; but the face of a closed body that stands on a surface,
//!   back to back, behind it;
//! * in front of lamps that come later in the scene;
//! * on the side on which it is already, if there is one.
//!
//! All techniques then see the same. A triangle that lies in nothing stays where it is. Where there is no room between two surfaces, it comes to lie in
//! the middle.

use super::Flat;
use super::geometry::{self, TRIANGLE};
use crate::bvh::{Bounds, leaf};
use crate::scene::{Scene, closed};
use glam::DVec3;
use restir_shared::num::flush;
use std::cell::OnceCell;
use std::collections::{BTreeSet, HashMap};

/// By which part of its largest coordinate a lamp has to be off another surface: twice as far as shadow rays end before it.
const APART: f64 = 1.0 / 131_072.0;
/// The same of the other surface's largest coordinate: eight roundings, by which hits may be off.
const APART_OF_OTHER: f64 = 1.0 / 1_048_576.0;
/// Nearer than this part of the larger coordinate, the rounding of four or so, surfaces lie in each other.
const ROUNDING: f64 = 1.0 / 2_097_152.0;
/// Least cosine between the normals of surfaces that lie in each other.
const PARALLEL: f64 = 0.995;
/// Least share of the smaller triangle that lies in the other one: those that meet at an edge have less in common.
const LEAST_SHARE: f64 = 1.0 / 256.0;
/// So many lamps that lie in each other are set apart, and a lamp is moved by at most so many distances.
const MOST_LEVELS: u32 = 8;
/// So many surfaces are looked at that a lamp lies in.
const MOST_RIVALS: usize = 64;
/// A triangle that is cut by three edges and two planes.
const MOST_CORNERS: usize = 8;

/// What was done to a scene.
#[derive(Clone, Debug, Default)]
pub(super) struct Coincident {
    /// The triangles that were moved.
    pub(super) moved: BTreeSet<usize>,
    /// Lamps and what they lay in, by their instances.
    instances: BTreeSet<[u32; 2]>,
}

impl Coincident {
    /// Lamps and what they lay in, by the names of their meshes.
    pub(super) fn names(&self, scene: &Scene) -> Vec<[String; 2]> {
        let name = |instance: u32| scene.meshes[scene.instances[instance as usize].mesh].name.clone();
        let names: BTreeSet<[String; 2]> = self.instances.iter().map(|pair| pair.map(name)).collect();
        names.into_iter().collect()
    }
}

/// Moves the triangles that emit, whose corners are among `corner_words` and lie in the boxes of `node_words`.
pub(super) fn set_apart(
    scene: &Scene,
    flat: &Flat,
    node_words: &[u32],
    corner_words: &mut [u32],
    emits: &impl Fn(usize) -> bool,
) -> Coincident {
    let closed = scene.meshes.iter().map(|_| OnceCell::new()).collect();
    let tree = Tree { scene, flat, node_words, corner_words, closed };
    let emitting = (0..flat.triangles.len()).filter(|&index| emits(index));
    let lamps: Vec<Lamp> = emitting.filter_map(|triangle| tree.lamp(triangle, emits)).collect();
    let heights = heights(&lamps);
    let mut found = Coincident::default();
    for (lamp, height) in lamps.iter().zip(heights).filter(|(_, height)| *height != 0.0) {
        move_along_normal(&mut corner_words[lamp.triangle * TRIANGLE..][..TRIANGLE], height);
        found.moved.insert(lamp.triangle);
        let instance = |index: usize| flat.triangles[index].object;
        let near = lamp.rivals.iter().filter(|rival| rival.gap.abs() < rival.apart);
        found.instances.extend(near.map(|rival| [instance(lamp.triangle), instance(rival.triangle)]));
    }
    found
}

/// How far each lamp is moved along its normal. Lamps that lie over others that are moved have to wait for these: one level a round.
fn heights(lamps: &[Lamp]) -> Vec<f64> {
    let places: HashMap<usize, usize> = lamps.iter().enumerate().map(|(at, lamp)| (lamp.triangle, at)).collect();
    let mut heights = vec![0.0; lamps.len()];
    for _ in 0..MOST_LEVELS {
        let of = |triangle: usize| places.get(&triangle).map_or(0.0, |&at| heights[at]);
        heights = lamps.iter().map(|lamp| lamp.height(&of)).collect();
    }
    heights
}

/// Moves a triangle, given by its words.
fn move_along_normal(words: &mut [u32], height: f64) {
    let corners = [0, 4, 8].map(|at| geometry::vector(words, at).as_dvec3());
    let along = Face::new(corners).normal * height;
    for (at, corner) in [0, 4, 8].into_iter().zip(corners) {
        let moved = (corner + along).to_array().map(|x| flush(x as f32).to_bits());
        words[at..at + 3].copy_from_slice(&moved);
    }
}

/// A triangle that emits, and the surfaces that it lies in or near.
#[derive(Debug)]
struct Lamp {
    triangle: usize,
    rivals: Vec<Rival>,
}

/// A surface that a lamp has to keep off.
#[derive(Clone, Copy, Debug)]
struct Rival {
    triangle: usize,
    /// How far the lamp lies in front of it, along the lamp's normal.
    gap: f64,
    /// 1 if both face the same side, else -1.
    facing: f64,
    /// How far it has to lie off.
    apart: f64,
    /// It is to lie in front.
    over: bool,
}

impl Lamp {
    /// How far it is moved, where others are moved by `of`.
    fn height(&self, of: &impl Fn(usize) -> f64) -> f64 {
        let (mut least, mut most, mut farthest) = (f64::NEG_INFINITY, f64::INFINITY, 0.0_f64);
        for &Rival { triangle, gap, facing, apart, over } in &self.rivals {
            let there = facing * of(triangle) - gap;
            if over {
                least = least.max(there + apart);
            } else {
                most = most.min(there - apart);
            }
            farthest = farthest.max(apart * f64::from(MOST_LEVELS));
        }
        let height = if least <= most { 0.0_f64.max(least).min(most) } else { 0.5 * (least + most) };
        height.clamp(-farthest, farthest)
    }
}

/// The triangles under their boxes.
struct Tree<'a> {
    scene: &'a Scene,
    flat: &'a Flat,
    node_words: &'a [u32],
    corner_words: &'a [u32],
    /// Of each mesh whether it is closed, where somebody has asked.
    closed: Vec<OnceCell<bool>>,
}

impl Tree<'_> {
    /// A triangle that emits, if it lies in another one.
    fn lamp(&self, triangle: usize, emits: &impl Fn(usize) -> bool) -> Option<Lamp> {
        let own = self.face(triangle);
        let mut rivals = Vec::new();
        self.visit(&own, &mut |other| {
            if other != triangle
                && let Some(gap) = own.over(&self.face(other))
            {
                rivals.extend(self.rival(triangle, other, gap, emits(other)));
            }
            rivals.len() < MOST_RIVALS
        });
        rivals.iter().any(|rival| rival.gap.abs() < rival.apart).then_some(Lamp { triangle, rivals })
    }

    /// What a lamp has to keep off another triangle, unless the other one does.
    fn rival(&self, lamp: usize, triangle: usize, gap: f64, emits: bool) -> Option<Rival> {
        let [own, other] = [lamp, triangle].map(|index| self.face(index));
        let [place, others] = [lamp, triangle].map(|index| self.flat.triangles[index].place());
        let facing = own.normal.dot(other.normal).signum();
        let tied = gap.abs() <= ROUNDING * own.reach().max(other.reach());
        if !tied && place[0] == others[0] {
            return None;
        }
        let over = if tied { emits || facing > 0.0 || !self.is_body(place[0]) } else { gap > 0.0 };
        let left_to_it = emits && if tied || facing < 0.0 { place > others } else { !over };
        (!left_to_it).then_some(Rival { triangle, gap, facing, apart: own.apart(&other), over })
    }

    /// Whether the instance is that of a closed mesh.
    fn is_body(&self, instance: u32) -> bool {
        let mesh = self.scene.instances[instance as usize].mesh;
        *self.closed[mesh].get_or_init(|| closed::closed(&self.scene.meshes[mesh]).is_some())
    }

    fn face(&self, triangle: usize) -> Face {
        let at = triangle * TRIANGLE;
        Face::new([0, 4, 8].map(|corner| geometry::vector(self.corner_words, at + corner).as_dvec3()))
    }

    /// Shows the triangles of all leaves whose boxes may come near to a face, as long as `show` wants more.
    fn visit(&self, face: &Face, show: &mut impl FnMut(usize) -> bool) {
        let bounds = face.bounds();
        let mut pending = vec![self.flat.bvh.root];
        while let Some(reference) = pending.pop() {
            if let Some(mut triangles) = leaf(reference) {
                if !triangles.all(&mut *show) {
                    return;
                }
                continue;
            }
            let children = self.flat.bvh.nodes[reference as usize].children;
            let boxes = geometry::child_bounds(self.node_words, reference as usize);
            pending
                .extend(children.into_iter().zip(boxes).filter(|(_, of)| is_near(of, &bounds)).map(|(child, _)| child));
        }
    }
}

/// Whether a triangle in the box may lie near to one in the bounds.
fn is_near(of: &Bounds, [lo, hi]: &[DVec3; 2]) -> bool {
    let (of_lo, of_hi) = (of.lo.as_dvec3(), of.hi.as_dvec3());
    let reach = [of_lo, of_hi, *lo, *hi].map(|corner| corner.abs().max_element()).into_iter().fold(0.0, f64::max);
    let near = 2.0 * APART * reach;
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

    /// How far a lamp has to be off another surface.
    fn apart(&self, other: &Face) -> f64 {
        (APART * self.reach()).max(APART_OF_OTHER * other.reach())
    }

    /// How far this lies in front of another one, on average where one lies over the other; `None` unless it lies in it, or as near as twice
    /// the distance that it has to be off.
    fn over(&self, other: &Face) -> Option<f64> {
        let cosine = self.normal.dot(other.normal).abs();
        let near = 2.0 * self.apart(other);
        let [a, b, c] = self.corners;
        let height = |p: DVec3| self.normal.dot(a - p);
        let heights = other.corners.map(height);
        let beyond = heights.iter().all(|h| *h > near) || heights.iter().all(|h| *h < -near);
        if cosine < PARALLEL || beyond {
            return None;
        }
        let mut common = Polygon::new(other.corners);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let inward = self.normal.cross(to - from);
            common = common.clipped(|p| inward.dot(p - from));
        }
        common = common.clipped(|p| near - height(p));
        common = common.clipped(|p| near + height(p));
        let share = common.area() * cosine / self.area.min(other.area * cosine);
        let mean = common.points().iter().map(|&p| height(p)).sum::<f64>() / common.points().len() as f64;
        (share > LEAST_SHARE).then_some(mean)
    }
}

/// A convex polygon.
struct Polygon {
    corners: [DVec3; MOST_CORNERS],
    len: usize,
}

impl Polygon {
    fn new([a, b, c]: [DVec3; 3]) -> Self {
        let mut corners = [DVec3::ZERO; MOST_CORNERS];
        corners[..3].copy_from_slice(&[a, b, c]);
        Self { corners, len: 3 }
    }

    fn points(&self) -> &[DVec3] {
        &self.corners[..self.len]
    }

    /// The part where `inside` is not negative (Sutherland and Hodgman 1974).
    fn clipped(&self, inside: impl Fn(DVec3) -> f64) -> Self {
        let mut left = Self { corners: [DVec3::ZERO; MOST_CORNERS], len: 0 };
        for (index, &to) in self.points().iter().enumerate() {
            let from = self.points()[(index + self.len - 1) % self.len];
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

    /// A plane adds a corner at most, but for rounding, by which a corner more would be one of the others.
    fn push(&mut self, corner: DVec3) {
        if self.len < MOST_CORNERS {
            self.corners[self.len] = corner;
            self.len += 1;
        }
    }

    /// Its area; 0 of less than three corners.
    fn area(&self) -> f64 {
        let points = self.points();
        let fan = |pair: &[DVec3]| (pair[0] - points[0]).cross(pair[1] - points[0]);
        0.5 * points.windows(2).map(fan).sum::<DVec3>().length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How far a stack of surfaces is moved: each its height in units of the distance that they keep, whether it emits, and whether it faces up.
    fn moved(stack: &[(f64, bool, bool)]) -> Vec<f64> {
        const UNIT: f64 = 1.0;
        let rivals = |lamp: usize| {
            let (own, _, own_up) = stack[lamp];
            let up = if own_up { 1.0 } else { -1.0 };
            let others = (0..stack.len()).filter(move |&other| other != lamp);
            others
                .filter_map(move |other| {
                    let (height, emits, other_up) = stack[other];
                    let (gap, facing) = (up * (own - height), if own_up == other_up { 1.0 } else { -1.0 });
                    let tied = gap.abs() < 0.1;
                    let over = if tied { true } else { gap > 0.0 };
                    let left_to_it = emits && if tied || facing < 0.0 { lamp > other } else { !over };
                    let kept = gap.abs() < 2.0 * UNIT && !left_to_it;
                    kept.then_some(Rival { triangle: other, gap, facing, apart: UNIT, over })
                })
                .collect()
        };
        let lamps: Vec<Lamp> = (0..stack.len())
            .filter(|&lamp| stack[lamp].1)
            .map(|triangle| Lamp { triangle, rivals: rivals(triangle) })
            .collect();
        let mut heights_of = vec![0.0; stack.len()];
        for (lamp, height) in lamps.iter().zip(heights(&lamps)) {
            heights_of[lamp.triangle] = if stack[lamp.triangle].2 { height } else { -height };
        }
        stack.iter().zip(heights_of).map(|((at, ..), by)| at + by).collect()
    }

    const SURFACE: (f64, bool, bool) = (0.0, false, true);

    const fn lamp(height: f64) -> (f64, bool, bool) {
        (height, true, true)
    }

    #[test]
    fn stacks_of_lamps_are_set_apart_in_any_order() {
        for (stack, expected) in [
            (vec![SURFACE, lamp(0.0)], vec![0.0, 1.0]),
            (vec![SURFACE, lamp(0.0), lamp(0.5)], vec![0.0, 1.0, 2.0]),
            (vec![lamp(0.5), lamp(0.0), SURFACE], vec![2.0, 1.0, 0.0]),
            (vec![lamp(0.0), lamp(0.5), lamp(1.0)], vec![0.0, 1.0, 2.0]),
            (vec![lamp(1.0), lamp(0.5), lamp(0.0)], vec![2.0, 1.0, 0.0]),
            // equal ones: the first in the file is in front
            (vec![lamp(0.0), lamp(0.0), lamp(0.0)], vec![2.0, 1.0, 0.0]),
            // back to back, and behind a cover
            (vec![lamp(0.0), (0.0, true, false)], vec![1.0, 0.0]),
            (vec![lamp(-0.5), SURFACE], vec![-1.0, 0.0]),
            // no room
            (vec![SURFACE, lamp(0.0), (0.9, false, true)], vec![0.0, 0.45, 0.9]),
            (vec![SURFACE, lamp(0.0), (1.8, false, true)], vec![0.0, 0.9, 1.8]),
            // far enough
            (vec![SURFACE, lamp(1.0), lamp(-1.2)], vec![0.0, 1.0, -1.2]),
        ] {
            let there = moved(&stack);
            let close = there.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-9);
            assert!(close, "{stack:?}: {there:?}, not {expected:?}");
        }
        let many = moved(&[lamp(0.0); 40]);
        assert!(many.iter().all(|height| (0.0..=f64::from(MOST_LEVELS)).contains(height)), "{many:?}");
    }

    #[test]
    fn faces_lie_in_each_other_where_they_have_area_in_common() {
        let face = |corners: [[f64; 3]; 3]| Face::new(corners.map(DVec3::from_array));
        let lamp = face([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let there = |dx: f64, dz: f64| face([[dx, 0.0, dz], [1.0 + dx, 0.0, dz], [1.0 + dx, 1.0, dz]]);
        assert_eq!(lamp.over(&there(0.0, 0.0)), Some(0.0));
        assert_eq!(lamp.over(&there(0.0, -1.0e-5)), Some(1.0e-5));
        assert!(lamp.over(&there(0.0, 1.0e-5)).is_some_and(|gap| gap == -1.0e-5));
        // a neighbour, one that is farther away, one that stands on it, and none at all
        let beside = face([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        let upright = face([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
        for other in [beside, there(1.0, 0.0), there(0.0, 1.0e-3), upright, face([[0.3; 3]; 3])] {
            assert_eq!(lamp.over(&other), None);
        }
    }
}
