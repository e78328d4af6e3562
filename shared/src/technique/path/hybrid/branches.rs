//! What of a path is traced: outside, across a body, and through one collision in it.

use super::params::*;
use super::record::{Entry, PackedExit};
use crate::bsdf::{Scattering, is_specular};
use crate::geometry::{Hit, Ray};
use crate::medium::{Interior, transmittance};
use crate::num;
use crate::rng::{self, Rng};
use crate::scene::{Lights, Location, Surface, SurfacePoint, Trace};
use crate::technique::path::walk::{DIMENSIONS_PER_SEGMENT, Numbers, Receiver};
use crate::technique::path::{MAX_DEPTH, PathFlags, Walk, camera_segment};
use crate::transport::{COLLISION_MARGIN, Collision, Departure, Vertex, absorbs};
use crate::vec::{dot, flush, max_abs};
use glam::{Vec2, Vec3};

/// Random dimensions of a stage's vertices, and of the collision.
const STAGES: u32 = 1 << 22;
const PER_STAGE: u32 = 1 << 16;
const COLLISION: u32 = STAGES - 2;
const _: () = assert!(MAX_DEPTH * DIMENSIONS_PER_SEGMENT < PER_STAGE);

/// From the camera to where the path enters a body. The stages are in the order of their flags.
const BEFORE: u32 = 0;
/// Across the body, and on.
const ACROSS: u32 = 1;
/// Through one collision, and on.
const COLLIDED: u32 = 2;
/// On from a point of the profile: before the other two.
const BESIDE: u32 = 3;

/// Sums what counts, and knows by what the path went on.
#[derive(Clone, Copy)]
struct Found<const BEGINS: bool> {
    sum: Vec3,
    counts: bool,
    /// How much of it counts, up to where the path enters a body; beyond, all does.
    share: f32,
    by_lobe: u32,
}

impl<const BEGINS: bool, M: Scattering> Receiver<M> for Found<BEGINS> {
    #[inline(always)]
    fn add(&mut self, value: Vec3) {
        if self.counts {
            self.sum += if BEGINS { value * self.share } else { value };
        }
    }

    #[inline(always)]
    fn depart(&mut self, departure: &Departure) {
        self.by_lobe = departure.sample.lobe;
    }
}

/// A path up to where it enters a body, if it `BEGINS`, else its branches from there on, one after another.
pub(super) struct Branches<const BEGINS: bool> {
    walk: Walk,
    found: Found<BEGINS>,
    stage: u32,
    alive: bool,
    /// The segment that is traced next lies in the body.
    inside: bool,
    entry: Entry,
    interior: Interior,
    /// From where the path enters, in its direction, as far as the border: zero, if there is none.
    across: Ray,
    /// How far from the surface that begins.
    lead: f32,
    collision: Collision,
}

impl Branches<true> {
    /// The path of a sample from the camera on.
    #[inline(always)]
    pub(super) fn new(params: &HybridParams, rng: &Rng, features: u32, pixel: [u32; 2]) -> Self {
        let walk = Walk::new(camera_segment(&params.path, rng, features, pixel));
        Self {
            walk,
            found: Found { sum: Vec3::ZERO, counts: false, share: params.share(1.0, 0.0), by_lobe: 0 },
            stage: BEFORE,
            alive: params.path.max_depth > 0,
            inside: false,
            entry: Entry::NONE,
            interior: Interior::NONE,
            across: Ray::NONE,
            lead: 0.0,
            collision: Collision::NONE,
        }
    }
}

impl Branches<false> {
    /// What is left of a path that has entered a body.
    #[inline(always)]
    pub(super) fn from_body<S: Surface>(scene: &S, entry: Entry, exit: PackedExit) -> Self {
        let (at, interior) = (scene.location(&entry.hit), scene.interior(&entry.hit));
        Self {
            walk: exit.walk(),
            found: Found { sum: exit.radiance(), counts: false, share: 1.0, by_lobe: 0 },
            stage: BESIDE,
            alive: exit.goes_on(),
            inside: false,
            entry,
            interior,
            across: entry.across(&at),
            lead: entry.lead(&at),
            collision: Collision::NONE,
        }
    }
}

impl<const BEGINS: bool> Branches<BEGINS> {
    /// What was found so far.
    #[inline(always)]
    pub(super) fn radiance(&self) -> Vec3 {
        self.found.sum
    }

    /// Where the path enters.
    #[inline(always)]
    pub(super) fn entry(&self) -> &Entry {
        &self.entry
    }

    /// Goes on until all branches have ended. False if the device cut a loop short: what was found is then not the whole.
    #[inline(always)]
    pub(super) fn run<S: Trace + Surface + Lights>(&mut self, scene: &S, params: &HybridParams, rng: &Rng) -> bool {
        let mut cut = false;
        // a compiler knows the value of a loop's condition after it, even where a driver has cut the loop: rounds are counted beside it
        let (mut rounds, mut ended) = (0_u32, 0_u32);
        let mut going = true;
        while going {
            rounds = rounds.wrapping_add(1);
            if self.alive {
                cut = self.step(scene, params, rng);
            }
            if !(BEGINS | cut | self.alive) {
                self.next(scene.features(), params, rng);
            }
            going = self.alive & !cut;
            ended = if going { ended } else { rounds };
        }
        !cut & (ended == rounds)
    }

    /// Traces a segment; whether the device cut it short.
    #[inline(always)]
    fn step<S: Trace + Surface + Lights>(&mut self, scene: &S, params: &HybridParams, rng: &Rng) -> bool {
        self.found.counts = params.has(PathFlags::of_stage(self.stage));
        let known = self.is_inside() & (self.stage == ACROSS);
        let hit = if known { self.entry.far } else { scene.closest(&self.walk.ray) };
        let cut = hit.is_cut();
        if BEGINS & self.entry.alive {
            self.entry.far = hit;
            self.entry.alive = !cut;
            self.alive = false;
        } else if hit.is_hit() & !cut {
            self.meet(scene, params, rng, &hit);
        } else {
            if !(cut | self.is_inside()) {
                self.walk.escape(scene, &mut self.found);
            }
            self.alive = false;
        }
        cut
    }

    #[inline(always)]
    fn is_inside(&self) -> bool {
        !BEGINS & self.inside
    }

    /// Begins the next branch, if there is one.
    #[inline(always)]
    fn next(&mut self, features: u32, params: &HybridParams, rng: &Rng) {
        if self.stage == BESIDE {
            self.cross(params);
        } else if (self.stage == ACROSS) & params.has(PathFlags::SINGLE) & (self.across.t_max > 0.0) {
            self.collide(features, params, rng);
        }
    }

    /// What happens at a surface.
    #[inline(always)]
    fn meet<S: Trace + Surface + Lights>(&mut self, scene: &S, params: &HybridParams, rng: &Rng, hit: &Hit) {
        let point = scene.surface(&self.walk.ray, hit);
        let met = scene.interior(hit);
        let front = dot(point.normal, self.walk.ray.direction) <= 0.0;
        let inside = self.is_inside();
        let leaves = !front & met.closed & (met.body == self.interior.body);
        let enters = !inside & front & met.closed & met.filled;
        // a path enters once: later bodies have their colour, and what would be a segment in them counts as one
        let later = !BEGINS & enters;
        let point = if later {
            let color = met.medium(scene.absorbed(hit)).color();
            SurfacePoint { material: point.material.closed(color), ..point }
        } else {
            point
        };
        self.dim(scene.features(), &point, hit);
        self.walk.arrive(scene, hit, &point, &mut self.found);
        self.walk.depth += if later { 1 } else { 0 };
        // what goes on from a profile may be worth less than nothing, in all channels
        self.alive = (self.walk.depth < params.path.max_depth) & (max_abs(self.walk.throughput) > 0.0);
        self.alive &= !inside | (leaves & self.found.counts);
        if self.alive {
            let passed = self.scatter(scene, params, rng, &point, enters);
            let entered = BEGINS & self.alive & passed & enters;
            if entered {
                self.enter(&scene.location(hit), hit, met.gain);
            }
            self.alive &= if inside { passed } else { !(passed & enters) };
            // one more ray, for all who ask what lies across
            self.alive |= entered & params.has(PathFlags::BOUNDARY | PathFlags::SINGLE | PathFlags::THICKNESS);
            self.inside = false;
        }
    }

    /// Takes off what is lost on the way to a surface: by one exponential for all kinds of segments, for the kernel has no room for three.
    #[inline(always)]
    fn dim<M>(&mut self, features: u32, point: &SurfacePoint<M>, hit: &Hit) {
        let Walk { throughput, ray, .. } = self.walk;
        let inside = self.is_inside();
        let across = inside & (self.stage == ACROSS);
        let length = if across { hit.t + self.lead } else { hit.t };
        let extinction = if inside { self.interior.extinction } else { point.absorption };
        if BEGINS {
            self.entry.travelled += hit.t;
        }
        if across {
            self.across.t_max = length;
        }
        if inside || absorbs(point, &ray, features) {
            let left = transmittance(extinction, length);
            let left = if inside & !across { self.collision.worth_of(hit.t, left) } else { left };
            self.walk.throughput = flush(throughput * left);
        }
    }

    /// Samples a light and the next direction; whether that goes behind the surface. Inside it is dark.
    #[inline(always)]
    fn scatter<S: Trace + Surface + Lights>(
        &mut self,
        scene: &S,
        params: &HybridParams,
        rng: &Rng,
        point: &SurfacePoint<S::Material>,
        enters: bool,
    ) -> bool {
        let inside = self.is_inside();
        let vertex = Vertex::new(point, &self.walk.ray, scene.features());
        let depth = if BEGINS { 0 } else { self.entry.depth };
        let first = if BEGINS { 0 } else { STAGES + self.stage * PER_STAGE };
        let numbers = Numbers::<BEGINS>::of_branch(rng, first, self.walk.depth - depth);
        let sorts = BEGINS & (self.walk.depth == 1) & params.has(PathFlags::DIFFUSE | PathFlags::SPECULAR);
        let mut towards = Vec3::ZERO;
        let open = |direction: Vec3| {
            towards = direction;
            !if vertex.is_behind(direction) { enters } else { inside }
        };
        let light = self.walk.connect(scene, &vertex, numbers.light(), open, &mut self.found);
        let specular = if sorts { vertex.specular_share(towards) } else { 0.0 };
        let roulette = params.has(PathFlags::ROULETTE);
        let departure = self.walk.bounce(scene.features(), &vertex, numbers.scatter(), roulette, || numbers.roulette());
        self.alive = departure.alive;
        let before = self.found;
        if sorts {
            self.found = Found { sum: Vec3::ZERO, share: 1.0, ..before };
        }
        light.arrive(scene, &mut self.found);
        Receiver::<S::Material>::depart(&mut self.found, &departure);
        if sorts {
            // a light was not found by a lobe: those that might have found it have their shares in it
            let light = self.found.sum * params.share(1.0 - specular, specular);
            let (diffuse, specular) = if is_specular(self.found.by_lobe) { (0.0, 1.0) } else { (1.0, 0.0) };
            self.found = Found { sum: before.sum + light, share: params.share(diffuse, specular), ..self.found };
        }
        vertex.is_behind(self.walk.ray.direction)
    }

    /// The path enters a body.
    #[inline(always)]
    fn enter(&mut self, at: &Location, hit: &Hit, gain: f32) {
        let Walk { throughput, depth, ray, .. } = self.walk;
        let gain = if is_specular(self.found.by_lobe) { gain } else { 1.0 };
        let Entry { travelled, far, .. } = self.entry;
        let direction = ray.direction;
        self.entry = Entry { hit: *hit, direction, throughput, gain, depth, travelled, far, alive: true };
        self.walk.ray = Ray { t_max: Ray::FAR, ..self.entry.across(at) };
    }

    /// What light inside is worth, of channels that are not Lambertian.
    #[inline(always)]
    fn throughput(&self, params: &HybridParams) -> Vec3 {
        self.entry.throughput * params.fit().spread(&self.interior, self.entry.travelled)
    }

    /// Begins the branch across the body.
    #[inline(always)]
    fn cross(&mut self, params: &HybridParams) {
        let ray = Ray { t_max: Ray::FAR, ..self.across };
        self.walk = Walk { throughput: self.throughput(params), depth: self.entry.depth, ..Walk::new(ray) };
        self.inside = true;
        self.alive = params.has(PathFlags::BOUNDARY | PathFlags::SINGLE);
        self.stage = ACROSS;
    }

    /// Begins the branch that collides once.
    #[inline(always)]
    fn collide(&mut self, features: u32, params: &HybridParams, rng: &Rng) {
        let (words, more) = (rng.draw(COLLISION), rng.hash(COLLISION + 1));
        let pair = |x: u32, y: u32| Vec2::new(rng::unit(x), rng::unit(y));
        let numbers = [pair(words.w, words.z), pair(words.x, words.y), pair(more.x, more.y)];
        let Ray { origin, direction, t_max, .. } = self.across;
        // of a collision it is not asked how much it absorbs
        let medium = self.interior.medium(Vec3::ZERO);
        self.collision = Collision::sample(&medium, direction, t_max, numbers, params.way_out());
        // rays begin beside the surface, and end there
        let margin = num::max(self.interior.offset, max_abs(origin) * COLLISION_MARGIN);
        let farthest = num::max(t_max - self.lead - margin, 0.0);
        let along = num::clamp(self.collision.t - self.lead, 0.0, farthest);
        let ray = Ray {
            origin: origin + direction * along,
            direction: self.collision.direction,
            t_max: self.collision.reach,
            key: Ray::random_key(features, more.z),
        };
        self.walk = Walk { throughput: self.throughput(params), depth: self.entry.depth, ..Walk::new(ray) };
        self.inside = true;
        self.alive = true;
        self.stage = COLLIDED;
    }
}
