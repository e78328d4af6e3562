//! The loop of path tracing, which hands what it finds to a [`Receiver`].

use super::MAX_DEPTH;
use crate::bsdf::{Material, Scattering, ScatteringFunction};
use crate::camera::AFTER_CAMERA;
use crate::geometry::{Hit, Ray};
use crate::num;
use crate::rng::{self, Rng};
use crate::scene::{BsdfOf, EnvironmentPoint, LightSample, Lights, Surface, SurfacePoint, Trace};
use crate::transport::{
    Chosen, Connection, Departure, Vertex, emission_weight, environment_weight, next_event, through_interior,
};
use crate::vec::{flush, max_abs, max_component};
use glam::{UVec4, Vec3};

/// Random dimensions: after the camera's [`DIMENSIONS_PER_SEGMENT`] a segment, used or not, so that a
/// decision keeps its numbers whatever was decided before it.
const FIRST_DIMENSION: u32 = AFTER_CAMERA;
pub(super) const DIMENSIONS_PER_SEGMENT: u32 = 3;
pub(super) const LIGHT: u32 = 0;
const SCATTER: u32 = 1;
const ROULETTE: u32 = 2;
const _: () = assert!(FIRST_DIMENSION + MAX_DEPTH * DIMENSIONS_PER_SEGMENT <= rng::STREAM_DIMENSIONS);
/// Vertices at which numbers are drawn as the sampler spreads them. At later ones they are independent, which costs less. To spread
/// four, or all, does not lower the variance of `cornell-mitsuba`, `glossy` and `ajar`, and that of `glass`, where light passes two
/// surfaces before it meets the floor, by 12 % (64 samples a pixel, four seeds).
const SPREAD_VERTICES: u32 = 2;
/// Roulette leaves paths of up to three segments alone.
const ROULETTE_FROM: u32 = 3;
/// Roulette lets a path go on with at least this probability.
pub(super) const MIN_SURVIVAL: f32 = 0.05;

/// The random numbers at a vertex of a path. Those of the first vertices are spread over a pixel's samples: `JOINTLY` with the point
/// of the pixel and with each other, or each decision's for itself.
#[derive(Clone, Copy, Debug)]
pub struct Numbers<const JOINTLY: bool = true> {
    rng: Rng,
    dimension: u32,
}

impl Numbers {
    /// The numbers at the `vertex`-th hit of a path, counted from 1.
    #[inline(always)]
    pub fn at(rng: &Rng, vertex: u32) -> Self {
        Self::of_branch(rng, 0, vertex)
    }

    /// The numbers of another vertex, from `dimension` on, which are independent of each other.
    #[inline(always)]
    pub(super) fn independent(rng: &Rng, dimension: u32) -> Self {
        Self { rng: rng.independent(), dimension }
    }
}

impl<const JOINTLY: bool> Numbers<JOINTLY> {
    /// The numbers at the `vertex`-th hit, counted from 1, of a branch of a path, whose dimensions begin at `first`.
    #[inline(always)]
    pub(super) fn of_branch(rng: &Rng, first: u32, vertex: u32) -> Self {
        Self {
            rng: if vertex <= SPREAD_VERTICES { *rng } else { rng.independent() },
            dimension: first.wrapping_add(FIRST_DIMENSION + (vertex - 1).wrapping_mul(DIMENSIONS_PER_SEGMENT)),
        }
    }

    /// The numbers that [`Lights::sample_light`] takes.
    #[inline(always)]
    pub fn light(&self) -> UVec4 {
        self.draw(LIGHT)
    }

    /// The numbers that [`Vertex::depart`] takes.
    #[inline(always)]
    pub fn scatter(&self) -> UVec4 {
        self.draw(SCATTER)
    }

    /// [`Self::light`] and [`Self::scatter`]: of kernels that draw both, the code that draws is a good part, and here it stands once.
    #[inline(always)]
    fn both(&self) -> [UVec4; 2] {
        let [mut light, mut scatter] = [UVec4::ZERO; 2];
        let mut decision = LIGHT;
        while decision <= SCATTER {
            let words = self.draw(decision);
            light = if decision == LIGHT { words } else { light };
            scatter = words;
            decision += 1;
        }
        [light, scatter]
    }

    #[inline(always)]
    fn draw(&self, decision: u32) -> UVec4 {
        let dimension = self.dimension + decision;
        if JOINTLY { self.rng.draw_jointly(dimension) } else { self.rng.draw(dimension) }
    }

    /// The number, in [0, 1), by which roulette decides.
    #[inline(always)]
    pub(super) fn roulette(&self) -> f32 {
        rng::unit(self.rng.hash(self.dimension + ROULETTE).x)
    }
}

/// Takes what a path finds. A sum of the values is the path's radiance (`Vec3` is such a receiver); resampling keeps one of them,
/// an explanation writes all of them down.
///
/// Each `value` is a path's whole contribution: emission, throughput, the weight of the balance heuristic, over the density.
/// Calls come in the order of the path: after [`Self::arrive`] what concerns that vertex, after
/// [`Self::escape`] the environment.
pub trait Receiver<M: Scattering = Material> {
    /// Takes a contribution of any kind.
    fn add(&mut self, value: Vec3);

    /// Where the path's first segment ends, if that is known; a miss if it is to be traced.
    #[inline(always)]
    fn begins_at(&self) -> Hit {
        Hit::MISS
    }

    /// The vertex at the end of the next segment, which has met the scene at `hit`. Receivers whose paths share their first vertex may
    /// choose a point close by.
    #[inline(always)]
    fn place<S: Surface<Material = M>>(&mut self, scene: &S, walk: &Walk, hit: Hit) -> Hit {
        let _ = (scene, walk);
        hit
    }

    /// The path arrives at `point`: `walk` has the segment, and what light from here is worth.
    #[inline(always)]
    fn arrive(&mut self, walk: &Walk, hit: &Hit, point: &SurfacePoint<M>) {
        let _ = (walk, hit, point);
    }

    /// The surface itself emits `radiance`; `weight` is the share of scattering in finding it, in [0, 1].
    #[inline(always)]
    fn emission(&mut self, radiance: Vec3, weight: f32, value: Vec3) {
        let _ = (radiance, weight);
        self.add(value);
    }

    /// Whether the path ends at this vertex, before it scatters.
    #[inline(always)]
    fn ends(&mut self, walk: &Walk, vertex: &Vertex<M::Bsdf>) -> bool {
        let _ = (walk, vertex);
        false
    }

    /// Whether lights are to be sampled.
    #[inline(always)]
    fn samples_lights(&self) -> bool {
        true
    }

    /// The path goes on from the point, or tries to.
    #[inline(always)]
    fn scatter(&mut self, vertex: &Vertex<M::Bsdf>) {
        let _ = vertex;
    }

    /// A light sample was drawn at the vertex. Whether it is visible is not known yet.
    #[inline(always)]
    fn light(&mut self, light: &LightSample, connection: &Connection) {
        let _ = (light, connection);
    }

    /// The light sample reaches the vertex, which scatters `scattered` of it towards the path.
    #[inline(always)]
    fn next_event(&mut self, scattered: Vec3, value: Vec3) {
        let _ = scattered;
        self.add(value);
    }

    /// A direction was drawn at the vertex: the last that is said of it.
    #[inline(always)]
    fn depart(&mut self, departure: &Departure) {
        let _ = departure;
    }

    /// The path's last segment leaves the scene.
    #[inline(always)]
    fn escape(&mut self, walk: &Walk) {
        let _ = walk;
    }

    /// The environment shines along the last segment; `weight` is the share of scattering in finding it, in [0, 1].
    #[inline(always)]
    fn environment(&mut self, environment: &EnvironmentPoint, weight: f32, value: Vec3) {
        let _ = (environment, weight);
        self.add(value);
    }
}

impl<M: Scattering> Receiver<M> for Vec3 {
    #[inline(always)]
    fn add(&mut self, value: Vec3) {
        *self += value;
    }
}

/// The end of a path that grows.
#[derive(Clone, Copy, Debug)]
pub struct Walk {
    /// The segment that is traced next; its direction has unit length.
    pub ray: Ray,
    /// What radiance against the ray is worth at the path's beginning.
    pub throughput: Vec3,
    /// How the ray's direction was chosen.
    pub chosen: Chosen,
    /// Segments that have ended on surfaces.
    pub depth: u32,
}

impl Walk {
    /// A path that begins with `ray`, whose direction has unit length.
    #[inline(always)]
    pub fn new(ray: Ray) -> Self {
        Self { ray, throughput: Vec3::ONE, chosen: Chosen::NONE, depth: 0 }
    }

    /// Goes on until the path ends, at the latest after `max_depth` segments in all. False if the device cut a loop short: what
    /// the receiver has is then not the whole path.
    #[inline(always)]
    pub fn run<S: Trace + Surface + Lights, R: Receiver<S::Material>>(
        mut self,
        scene: &S,
        rng: &Rng,
        max_depth: u32,
        roulette: bool,
        receiver: &mut R,
    ) -> bool {
        let mut cut = false;
        let mut alive = self.depth < max_depth;
        while alive {
            let known = if self.depth == 0 { receiver.begins_at() } else { Hit::MISS };
            let hit = if known.is_hit() { known } else { scene.closest(&self.ray) };
            alive = hit.is_hit();
            cut = hit.is_cut();
            if alive {
                let hit = receiver.place(scene, &self, hit);
                let point = scene.surface(&self.ray, &hit);
                self.throughput = through_interior(self.throughput, &point, &self.ray, hit.t, scene.features());
                self.arrive(scene, &hit, &point, receiver);
                alive = self.depth < max_depth && max_component(self.throughput) > 0.0;
                if alive {
                    alive = self.scatter(scene, rng, &point, roulette, receiver);
                }
            } else if !cut {
                self.escape(scene, receiver);
            }
        }
        !(cut | alive)
    }

    /// The last segment leaves the scene.
    #[inline(always)]
    pub(super) fn escape<S: Surface + Lights, R: Receiver<S::Material>>(&self, scene: &S, receiver: &mut R) {
        receiver.escape(self);
        self.see(&scene.environment(self.ray.direction), receiver);
    }

    /// What the environment is in the direction of the last segment.
    #[inline(always)]
    pub(super) fn see<M: Scattering, R: Receiver<M>>(&self, environment: &EnvironmentPoint, receiver: &mut R) {
        if max_component(environment.radiance) > 0.0 {
            let weight = environment_weight(environment.density, self.chosen);
            receiver.environment(environment, weight, self.throughput * environment.radiance * weight);
        }
    }

    /// The segment ends on a surface.
    #[inline(always)]
    pub(super) fn arrive<S: Surface + Lights, R: Receiver<S::Material>>(
        &mut self,
        scene: &S,
        hit: &Hit,
        point: &SurfacePoint<S::Material>,
        receiver: &mut R,
    ) {
        receiver.arrive(self, hit, point);
        if max_component(point.emission) > 0.0 {
            self.find_emission(scene.light_density(hit), hit.t, point, receiver);
        }
        self.depth += 1;
    }

    /// The segment of length `t` ends on a surface that emits, where `density` is that of light samples.
    #[inline(always)]
    pub(super) fn find_emission<M: Scattering, R: Receiver<M>>(
        &self,
        density: f32,
        t: f32,
        point: &SurfacePoint<M>,
        receiver: &mut R,
    ) {
        let weight = emission_weight(density, point, &self.ray, t, self.chosen);
        receiver.emission(point.emission, weight, self.throughput * point.emission * weight);
    }

    /// Samples a light, then the next direction; whether there is one. The ray to the light is traced last: nothing of the vertex has to be
    /// kept meanwhile, which on a device takes registers.
    #[inline(always)]
    fn scatter<S: Trace + Surface + Lights, R: Receiver<S::Material>>(
        &mut self,
        scene: &S,
        rng: &Rng,
        point: &SurfacePoint<S::Material>,
        roulette: bool,
        receiver: &mut R,
    ) -> bool {
        let numbers = Numbers::at(rng, self.depth);
        let vertex = Vertex::new(point, &self.ray, scene.features());
        if receiver.ends(self, &vertex) {
            return false;
        }
        let [light, scatter] = numbers.both();
        let sampled = receiver.samples_lights();
        let light = self.connect(scene, &vertex, light, |_| sampled, receiver);
        let departure = self.bounce(scene.features(), &vertex, scatter, roulette, || numbers.roulette());
        light.arrive(scene, receiver);
        receiver.depart(&departure);
        departure.alive
    }

    /// Samples a light by [`Numbers::light`]; light from a direction that is not `open` cannot arrive.
    #[inline(always)]
    pub(super) fn connect<S: Surface + Lights, R: Receiver<S::Material>>(
        &self,
        scene: &S,
        vertex: &Vertex<BsdfOf<S>>,
        words: UVec4,
        open: impl FnOnce(Vec3) -> bool,
        receiver: &mut R,
    ) -> NextEvent {
        let mut next = NextEvent { shines: false, shadow: Ray::NONE, scattered: Vec3::ZERO, value: Vec3::ZERO };
        receiver.scatter(vertex);
        if vertex.bsdf.has_smooth_part() {
            let light = scene.sample_light(words);
            let connection = vertex.connect(&light);
            receiver.light(&light, &connection);
            next.shines = connection.shines() && open(connection.shadow.direction);
            if next.shines {
                next.shadow = connection.shadow;
                next.scattered = next_event(light.density, &connection);
                next.value = self.throughput * next.scattered;
            }
        }
        next
    }

    /// Samples the next direction by [`Numbers::scatter`]; whether the path goes on is what the departure says. Roulette, if it decides, asks
    /// for the `number` of [`Numbers::roulette`].
    #[inline(always)]
    pub(super) fn bounce<B: ScatteringFunction>(
        &mut self,
        features: u32,
        vertex: &Vertex<B>,
        words: UVec4,
        roulette: bool,
        number: impl FnOnce() -> f32,
    ) -> Departure {
        let mut departure = vertex.depart(words, features);
        let Departure { sample, ray, .. } = departure;
        self.chosen = Chosen { pdf: sample.pdf, alone: sample.delta };
        self.throughput = flush(self.throughput * sample.weight);
        self.ray = ray;
        if roulette && self.depth >= ROULETTE_FROM {
            // paths from a profile may be worth less than nothing
            let survival = num::clamp(max_abs(self.throughput), MIN_SURVIVAL, 1.0);
            departure.alive = departure.alive && number() < survival;
            self.throughput *= num::recip(survival);
        }
        departure
    }
}

/// A light sample at a vertex, whose visibility is not known yet.
pub(super) struct NextEvent {
    /// Light arrives, if nothing lies on the segment.
    shines: bool,
    shadow: Ray,
    /// What the vertex scatters of it towards the path.
    scattered: Vec3,
    /// That at the path's beginning.
    value: Vec3,
}

impl NextEvent {
    /// Gives the light to `receiver`, if it is visible.
    #[inline(always)]
    pub(super) fn arrive<S: Trace + Surface, R: Receiver<S::Material>>(&self, scene: &S, receiver: &mut R) {
        if self.shines && !scene.occluded(&self.shadow) {
            receiver.next_event(self.scattered, self.value);
        }
    }
}
