//! ReSTIR PT: what no preset has, and the paths of a picture's pixels and what shifts make of them.

use super::{Cases, Known, Matrix, NOTHING, Row, row};
use crate::stats::{Moments, ZTest};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_shared::camera::primary_ray;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::resample::mutual::{Record, Shift, ShiftResult};
use restir_shared::resample::params::ReuseParams;
use restir_shared::rng::{Rng, Sampler};
use restir_shared::scene::{EnvironmentPoint, SceneView, Still, Surface, SurfacePoint, Trace};
use restir_shared::shift::{Cause, Hybrid, Path, PathOrigin, Shifted};
use restir_shared::technique::path::{Receiver, Walk};
use restir_shared::technique::restir_pt::{Candidate, Candidates, Keep, PackedPath, PathNumbers, PtParams, Stored};
use restir_shared::transport::Vertex;
use restir_shared::vec::luminance;
use std::collections::BTreeMap;

/// See [`Known`].
pub(super) const KNOWN: Known = Known {
    lengths: &["min_distance"],
    rows: &[
        (
            "replay, two passes, defensive, jitter",
            "shift=replay,spatial=2,mis=pairwise-defensive,temporal_mis=pairwise-defensive,jitter=on",
        ),
        ("retraced", "changed=retrace"),
        ("direct light by restir-di", "direct=restir-di,neighbours=1"),
    ],
    cases: Cases { common: "still=off,tile=8,max_plane_distance=0.1,max_depth=7", rows: &ROWS, ..NOTHING.cases },
    matrix: Matrix {
        // through the centres of pixels many camera rays end on edges of the room of moving, where path tracing loses light
        scenes: &[("cornell", ""), ("tower", ""), ("glass", ""), ("glossy", ""), ("ajar", ""), ("moving", "jitter=on")],
        // in glossy and ajar for a bias of 5 % of a tile to be detectable; in moving for what the mean of the image hides
        goals: &[("cornell", 0.2), ("glossy", 0.45), ("ajar", 0.74), ("moving", 0.25)],
        tile_goal: f64::INFINITY,
        beyond: &[],
        common: "tile=8,max_depth=6",
        cells: || CELLS.map(str::to_owned).to_vec(),
    },
    ..NOTHING
};

/// Sharing alone, time alone, both with what neighbours have made, and with direct light by another technique.
const CELLS: [&str; 4] = [
    "temporal=off,shift=hybrid,mis=pairwise-defensive",
    "shift=reconnection,still=off,spatial=0,confidence_cap=5",
    "shift=hybrid,still=off,feedback=on",
    "shift=footprint,direct=restir-di",
];

/// Every criterion, kind of light and of surface.
const ROWS: [Row; 15] = [
    row("defaults", "cornell", 2, ""),
    row("hybrid, jitter", "glossy", 2, "shift=hybrid,jitter=on"),
    row("by footprint", "glass", 2, "mis=pairwise-defensive"),
    row("hybrid, two passes", "all-lights", 2, "shift=hybrid,neighbours=8,spatial=2"),
    row("replay", "all-lights", 2, "shift=replay,sampler=independent"),
    row("reconnection, environment", "tower", 2, "shift=reconnection"),
    row("hybrid, textures", "coats", 2, "shift=hybrid"),
    row("replay only, blended", "sheets", 2, ""),
    row("few replays, things move", "moving", 6, "shift=hybrid,replays=1,spatial=0"),
    row("stale, things move", "moving", 6, "changed=stale,shift=hybrid,confidence_cap=2,spatial=0"),
    row("a still view", "cornell", 3, "still=on,spatial=0"),
    row("paths of paths", "ajar", 3, "shift=hybrid,feedback=on"),
    row("retraced, things move", "moving", 6, "changed=retrace,shift=hybrid,spatial=0"),
    row("a lens, counted pairs", "cornell-lens", 2, "shift=hybrid,mis=pairwise-counted-defensive"),
    row("the longest paths", "furnace", 2, "shift=replay,max_depth=63"),
];

/// A picture whose pixels' paths are shifted to each other.
pub struct Picture<'a> {
    /// The scene.
    pub scene: SceneView<'a>,
    /// Parameters, with the criterion.
    pub params: PtParams,
    /// Where in its pixel a camera ray goes through.
    pub within: Vec2,
}

/// Anywhere but in the middle, where in symmetrical scenes some rays meet an edge exactly.
const ASIDE: Vec2 = Vec2::new(0.37, 0.61);

/// A path that a pixel has found.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// What `path` adds up.
    pub value: Vec3,
    /// The path that it is the contribution of.
    pub path: Path,
    /// The same, as it is stored.
    pub stored: PackedPath,
}

/// Keeps all candidates, and what the first segment finds.
#[derive(Default)]
struct All {
    found: Vec<(Vec3, Candidate)>,
    direct: Vec3,
}

impl Keep for All {
    fn candidate(&mut self, value: Vec3, candidate: &Candidate) {
        self.found.push((value, *candidate));
    }

    fn direct(&mut self, value: Vec3) {
        self.direct += value;
    }
}

impl<'a> Picture<'a> {
    /// Of `side` by `side` pixels, whose random numbers are independent.
    pub fn new(buffers: &'a SceneBuffers, side: u32, depth: u32, hybrid: Hybrid) -> Self {
        let scene = buffers.view();
        let reuse = ReuseParams {
            scene: scene.header,
            camera: buffers.camera.params(side, side),
            width: side,
            height: side,
            seed: 1,
            layers: 1,
            ..ReuseParams::default()
        };
        let params = PtParams { reuse, hybrid, max_depth: depth };
        Self { scene, params, within: ASIDE }
    }

    /// Other random numbers.
    #[must_use]
    pub fn with_seed(self, seed: u32) -> Self {
        Self { params: PtParams { reuse: ReuseParams { seed, ..self.params.reuse }, ..self.params }, ..self }
    }

    /// Another criterion.
    #[must_use]
    pub fn with(&self, hybrid: Hybrid) -> Self {
        Self { params: PtParams { hybrid, ..self.params }, ..*self }
    }

    /// Seen through the middles of pixels, as the technique has it without jitter.
    #[must_use]
    pub fn through_middles(self) -> Self {
        Self { within: Vec2::splat(0.5), ..self }
    }

    fn ray(&self, [x, y]: [u32; 2]) -> Ray {
        primary_ray(&self.params.camera, Vec2::new(x as f32, y as f32) + self.within, Vec2::ZERO)
    }

    /// Where the paths of a pixel begin, if it sees a surface.
    pub fn start(&self, at: [u32; 2]) -> Option<PathOrigin> {
        let ray = self.ray(at);
        let hit = self.scene.closest(&ray);
        hit.is_hit().then(|| PathOrigin::new(&ray, &self.scene.off_edges(&hit)))
    }

    fn numbers(&self, [x, y]: [u32; 2], frame: u32) -> PathNumbers {
        PathNumbers::new(Rng::new(x, y, frame, self.params.seed, Sampler::Independent))
    }

    fn walk(&self, at: [u32; 2], frame: u32) -> (PathNumbers, All) {
        let numbers = self.numbers(at, frame);
        let (features, joins) = (self.scene.features, self.params.joins(&numbers));
        let mut candidates = Candidates::<_, false>::new(All::default(), features, numbers.key(), joins, true, PathOrigin::NONE);
        Walk::new(self.ray(at)).run(&self.scene, numbers.rng(), self.params.max_depth, false, &mut candidates);
        (numbers, candidates.keep)
    }

    /// All paths to light that a pixel finds in a frame.
    pub fn found(&self, at: [u32; 2], frame: u32) -> Vec<Found> {
        let (numbers, all) = self.walk(at, frame);
        let stored = |&(value, candidate): &(Vec3, Candidate)| {
            let path = candidate.path(&self.scene, &numbers);
            Found { value, path, stored: Stored { path, value, contribution_weight: 1.0, confidence: 1.0 }.pack() }
        };
        all.found.iter().filter(|(value, _)| value.max_element() > 0.0).map(stored).collect()
    }

    /// The sum of what a pixel finds, in the order in which it finds it; and what `path` says.
    pub fn sums(&self, at: [u32; 2], frame: u32) -> [Vec3; 2] {
        let (numbers, all) = self.walk(at, frame);
        let mut sum = Vec3::ZERO;
        Walk::new(self.ray(at)).run(&self.scene, numbers.rng(), self.params.max_depth, false, &mut sum);
        [all.found.iter().fold(all.direct, |sum, (value, _)| sum + *value), sum]
    }

    /// A path at another start.
    pub fn shift(&self, path: &PackedPath, start: &PathOrigin) -> Shifted {
        path.shifted(&Still(&self.scene), &self.params, start)
    }

    /// Pairs of pixels that see surfaces, `step` apart, none of which is in two pairs.
    pub fn pairs(&self, [dx, dy]: [u32; 2]) -> Vec<[[u32; 2]; 2]> {
        let PtParams { reuse: ReuseParams { width, height, .. }, .. } = self.params;
        let mut free = vec![true; (width * height) as usize];
        let mut pairs = Vec::new();
        for (x, y) in (0..height - dy).flat_map(|y| (0..width - dx).map(move |x| (x, y))) {
            let pair = [[x, y], [x + dx, y + dy]];
            let index = pair.map(|[x, y]| (y * width + x) as usize);
            if index.iter().all(|&i| free[i]) && pair.iter().all(|&at| self.start(at).is_some()) {
                index.iter().for_each(|&i| free[i] = false);
                pairs.push(pair);
            }
        }
        pairs
    }
}

/// What path tracing finds from vertex k of a path on, by the path's random numbers: of all its light that of a path of this length and kind.
pub fn followed(scene: &SceneView<'_>, numbers: &PathNumbers, path: &Path) -> Vec3 {
    // from where does not matter to a direction that leaves
    let towards = Ray { origin: Vec3::ZERO, direction: -path.direction, t_max: Ray::FAR, key: 0 };
    let vertex = Vertex::new(&scene.surface(&towards, &path.hit), &towards, scene.features);
    let ray = Ray { origin: vertex.origin(path.direction), direction: path.direction, ..towards };
    let mut last = Last { path, vertex: 0, beyond: Vec3::ZERO, found: Vec3::ZERO };
    let walk = Walk { depth: path.reconnection, ..Walk::new(ray) };
    let whole = walk.run(scene, numbers.rng(), path.length, false, &mut last);
    if whole { last.found } else { Vec3::ZERO }
}

/// Keeps what is found at the end of a path.
struct Last<'a> {
    path: &'a Path,
    vertex: u32,
    beyond: Vec3,
    found: Vec3,
}

impl Last<'_> {
    fn see(&mut self, light_sampled: bool, vertex: u32, radiance: Vec3) {
        if (light_sampled, vertex) == (self.path.light_sampled, self.path.length) {
            self.found = self.beyond * radiance;
        }
    }
}

impl Receiver for Last<'_> {
    fn add(&mut self, _value: Vec3) {}

    fn arrive(&mut self, walk: &Walk, _hit: &Hit, _point: &SurfacePoint) {
        (self.vertex, self.beyond) = (walk.depth + 1, walk.throughput);
    }

    fn emission(&mut self, radiance: Vec3, weight: f32, _value: Vec3) {
        self.see(false, self.vertex, radiance * weight);
    }

    fn next_event(&mut self, scattered: Vec3, _value: Vec3) {
        self.see(true, self.vertex + 1, scattered);
    }

    fn escape(&mut self, walk: &Walk) {
        (self.vertex, self.beyond) = (walk.depth + 1, walk.throughput);
    }

    fn environment(&mut self, environment: &EnvironmentPoint, weight: f32, _value: Vec3) {
        self.see(false, self.vertex, environment.radiance * weight);
    }
}

/// What became of shifts there and back.
#[derive(Clone, Debug, Default)]
pub struct Returns {
    /// Shifts that gave a path, and those that did not, by the cause.
    pub there: BTreeMap<Cause, u64>,
    /// Of those that gave one, what the way back gave.
    pub back: BTreeMap<Cause, u64>,
    /// Of those that came back, the ones whose stored words say another path than was found.
    pub changed: u64,
    /// Of the others, those whose integrand is off by more than [`INTEGRAND`] from what path tracing found.
    pub off: u64,
    /// The largest relative error of an integrand that came back.
    pub worst: f64,
    /// Sum over the contributions of paths that do not return, over that of all that were shifted.
    pub lost: [f64; 2],
}

/// The relative error of an integrand that has been elsewhere and is home again: that of a direction of 48 bits and coordinates of 24.
/// Smooth lobes and near points make more of them, which is why a share of paths may be off by more.
pub const INTEGRAND: f64 = 1.0e-5;

impl Returns {
    /// Paths that were shifted.
    pub fn shifted(&self) -> u64 {
        self.back.values().sum()
    }

    /// Paths that were shifted and do not return.
    pub fn one_sided(&self) -> u64 {
        self.back.iter().filter(|(cause, _)| **cause != Cause::Nothing).map(|(_, count)| count).sum()
    }

    /// The share of the paths that were shifted and do not return.
    pub fn one_sided_share(&self) -> f64 {
        self.one_sided() as f64 / self.shifted().max(1) as f64
    }

    /// The share of those that came back whose integrand is off.
    pub fn off_share(&self) -> f64 {
        self.off as f64 / (self.shifted() - self.one_sided()).max(1) as f64
    }

    /// The share of the contributions that does not return: what the mean of all pixels can be off by where every path is shared.
    pub fn lost_share(&self) -> f64 {
        self.lost[0] / self.lost[1].max(f64::MIN_POSITIVE)
    }

    /// Shifts the paths that the first pixel of each pair finds in each of so many frames to the second, and back.
    pub fn of(picture: &Picture<'_>, pairs: &[[[u32; 2]; 2]], frames: u32, wrong: Wrong) -> Self {
        let of_pair = |&[x, y]: &[[u32; 2]; 2]| {
            let mut returns = Self::default();
            let (Some(home), Some(away)) = (picture.start(x), picture.start(y)) else { return returns };
            for found in (0..frames).flat_map(|frame| picture.found(x, frame)) {
                returns.add(picture, &found, [&home, &away], wrong);
            }
            returns
        };
        let all: Vec<Self> = pairs.par_iter().map(of_pair).collect();
        all.into_iter().fold(Self::default(), Self::merge)
    }

    fn merge(mut self, other: Self) -> Self {
        for (sum, counts) in [(&mut self.there, other.there), (&mut self.back, other.back)] {
            counts.into_iter().for_each(|(cause, count)| *sum.entry(cause).or_default() += count);
        }
        self.changed += other.changed;
        self.off += other.off;
        self.worst = self.worst.max(other.worst);
        self.lost = [self.lost[0] + other.lost[0], self.lost[1] + other.lost[1]];
        self
    }

    fn add(&mut self, picture: &Picture<'_>, found: &Found, [home, away]: [&PathOrigin; 2], wrong: Wrong) {
        let there = picture.shift_wrongly(&found.stored, away, wrong);
        *self.there.entry(there.cause).or_default() += 1;
        if there.term == 0.0 {
            return;
        }
        let moved = found.stored.moved(&ShiftResult::of(&there));
        // what it has become has to be a path of the second pixel's own, or that pixel would not shift it
        let own = picture.shift(&moved, away);
        let back = if own.term == 0.0 { own } else { picture.shift(&moved, home) };
        *self.back.entry(back.cause).or_default() += 1;
        let sent = f64::from(there.value.element_sum()) * f64::from(there.term) / f64::from(found.path.term);
        self.lost[1] += sent;
        if back.term == 0.0 {
            self.lost[0] += sent;
            return;
        }
        let returned = moved.moved(&ShiftResult::of(&back)).unpack();
        self.changed += u64::from(!is_stored(&found.path, &returned.path));
        let error = f64::from((returned.value - found.value).abs().max_element() / found.value.max_element());
        self.off += u64::from(error > INTEGRAND);
        self.worst = self.worst.max(error);
    }
}

/// How far a direction of 48 bits is from what was stored, of which glass makes one whose length is not quite 1.
const DIRECTION: f64 = 8.0e-7;

/// Whether a path that was unpacked is the one that was found, but for what storing it loses and for its term, which belongs to a start.
fn is_stored(found: &Path, stored: &Path) -> bool {
    let near = |a: Vec2, b: Vec2, most: f32| (a - b).abs().max_element() <= most;
    let surface = !found.keeps_surface()
        || (found.hit.id == stored.hit.id && near(found.hit.uv, stored.hit.uv, restir_shared::num::UNIT_ROUNDOFF));
    let direction = found.reconnection == 0
        || found.keeps_light()
        || (found.direction.as_dvec3().normalize() - stored.direction.as_dvec3()).length() < DIRECTION;
    let radiance = found.reconnection == 0 || found.keeps_light() || found.radiance == stored.radiance;
    let light = !found.keeps_light() || found.light == stored.light;
    let decided = |path: &Path| (path.key, path.length, path.reconnection, path.light_sampled, path.lobes);
    decided(found) == decided(stored) && surface && direction && radiance && light
}

/// A way to shift wrongly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// Right.
    Not,
    /// The Jacobian is left out.
    NoJacobian,
    /// The Jacobian is that of the way back.
    Inverted,
    /// Where a path may be joined is asked of the path that is shifted, and not of what it becomes.
    ForwardOnly,
}

impl Wrong {
    /// The weight of what is shifted with that Jacobian, which is 0 of what cannot be shifted.
    fn weight(self, jacobian: f64) -> f64 {
        let jacobian = match self {
            _ if jacobian == 0.0 || jacobian.is_nan() => return 0.0,
            Self::Not | Self::ForwardOnly => jacobian,
            Self::NoJacobian => 1.0,
            Self::Inverted => jacobian.recip(),
        };
        jacobian / (1.0 + jacobian)
    }
}

/// What the second pixels of pairs get by shifts of the first one's paths, less what they find of it themselves, each by its weight in
/// the balance heuristic between the two: a shift of Jacobian J brings J / (1 + J), and takes the place of as much of what the shift
/// back would take away. Zero in the mean, if shifts are undone and Jacobians right.
#[derive(Clone, Copy, Debug, Default)]
pub struct Arrivals {
    /// The difference, of each pair and frame, in luminance.
    pub difference: Moments,
    /// What the pixels find of it themselves.
    pub own: Moments,
}

impl Arrivals {
    /// Of so many frames, whose random numbers have nothing to do with each other.
    pub fn of(picture: &Picture<'_>, pairs: &[[[u32; 2]; 2]], frames: u32, wrong: Wrong) -> Self {
        let of_pair = |&[x, y]: &[[u32; 2]; 2]| {
            let mut arrivals = Self::default();
            let (Some(home), Some(away)) = (picture.start(x), picture.start(y)) else { return arrivals };
            for frame in 0..frames {
                let arriving: f64 =
                    picture.found(x, frame).iter().map(|found| picture.arriving(&found.stored, &away, wrong)).sum();
                let own: f64 = picture.found(y, frame).iter().map(|found| picture.replaced(found, &home, wrong)).sum();
                arrivals.difference.push(arriving - own);
                arrivals.own.push(own);
            }
            arrivals
        };
        let all: Vec<Self> = pairs.par_iter().map(of_pair).collect();
        all.into_iter().fold(Self::default(), |sum, pair| Self {
            difference: sum.difference.merge(pair.difference),
            own: sum.own.merge(pair.own),
        })
    }

    /// As a test of the difference; its power is relative to what the pixels find themselves.
    pub fn test(&self) -> ZTest {
        ZTest::new(self.difference, Moments::exact(0.0))
    }
}

impl Picture<'_> {
    /// Of the wrong ways only that matters here which takes paths to other places.
    fn shift_wrongly(&self, stored: &PackedPath, away: &PathOrigin, wrong: Wrong) -> Shifted {
        let anywhere = Hybrid { replays: self.params.hybrid.replays, ..Hybrid::RECONNECTION };
        if wrong == Wrong::ForwardOnly && stored.unpack().path.reconnection == 2 {
            self.with(anywhere).shift(stored, away)
        } else {
            self.shift(stored, away)
        }
    }

    fn arriving(&self, stored: &PackedPath, away: &PathOrigin, wrong: Wrong) -> f64 {
        let shifted = self.shift_wrongly(stored, away, wrong);
        brightness(shifted.value) * wrong.weight(f64::from(shifted.term) / f64::from(stored.unpack().path.term))
    }

    fn replaced(&self, found: &Found, home: &PathOrigin, wrong: Wrong) -> f64 {
        let jacobian = f64::from(self.shift(&found.stored, home).term) / f64::from(found.stored.unpack().path.term);
        brightness(found.value) * wrong.weight(jacobian)
    }
}

fn brightness(v: Vec3) -> f64 {
    f64::from(luminance(v))
}
