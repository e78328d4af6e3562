//! The loop of a path through media.

use super::walker::{Walker, enclosing, entry, storable};
use super::{MAX_WALK, MediaParams};
use crate::bsdf::{Dielectric, Scattering, ScatteringFunction};
use crate::geometry::{Hit, Ray};
use crate::medium::{Channels, Interior};
use crate::num;
use crate::rng::{self, Rng};
use crate::sampling::{henyey_greenstein_shape, sample_henyey_greenstein};
use crate::scene::{LightSample, Lights, Location, Surface, SurfacePoint, Trace};
use crate::technique::path::walk::{DIMENSIONS_PER_SEGMENT, LIGHT, MIN_SURVIVAL, Numbers, Receiver};
use crate::technique::path::{PathFlags, Walk};
use crate::transport::{
    COLLISION_MARGIN, Chosen, Connection, GRAZING_COSINE, Vertex, connect_inside, next_event, passes, through_interior,
};
use crate::vec::{Frame, dot, flush, max_abs, max_component, normalize};
use glam::{UVec4, Vec2, Vec3};

/// Random dimensions inside of media, counted by segment: one of each segment's flight, and those of a vertex at its end.
const FLIGHT: u32 = 1 << 20;
const BOUNDARY: u32 = 1 << 21;
const _: () = assert!(BOUNDARY + MAX_WALK * DIMENSIONS_PER_SEGMENT <= rng::STREAM_DIMENSIONS);
const _: () = assert!(FLIGHT + MAX_WALK < BOUNDARY);

/// Roulette leaves walks of up to so many collisions alone.
const ROULETTE_FROM: u32 = 16;
/// Reflections from inside that may follow each other: light that is caught in a clear body ends after them.
const MOST_REFLECTIONS: u32 = 64;

/// What is around a path.
#[derive(Clone, Copy)]
struct Around {
    interior: Interior,
    /// Where the segment begins, light has come so far from the surface already: rays begin beside it. Outside, behind a clear border, so far
    /// from the last collision.
    lead: f32,
    reflections: u32,
    /// The path has just left a body that lies in another one, which is asked for next: at the walker's entry.
    returns: bool,
}

impl Around {
    #[inline(always)]
    fn new(interior: Interior, lead: f32) -> Self {
        Self { interior, lead, reflections: 0, returns: false }
    }
}

/// How far light flies inside of an interior.
struct Flight {
    channels: Channels,
    /// From the surface, or the last collision, to the next collision.
    distance: f32,
    /// Where the ray ends, which begins beside the surface.
    t: f32,
    /// A surface that is nearer than this behind the end is too near: by rounding the end may lie behind it.
    margin: f32,
    words: UVec4,
}

impl Flight {
    /// A flight outside of all media.
    const NONE: Self =
        Self { channels: Channels::NONE, distance: Ray::FAR, t: Ray::FAR, margin: 0.0, words: UVec4::ZERO };
}

/// Sums what counts.
struct Orders {
    sum: Vec3,
    counts: bool,
}

impl<M: Scattering> Receiver<M> for Orders {
    #[inline(always)]
    fn add(&mut self, value: Vec3) {
        if self.counts {
            self.sum += value;
        }
    }
}

/// A light that is looked for from where it was drawn, ray by ray: on a straight way, which may leave the body that it begins in.
struct Look {
    sight: Sight,
    /// Of the light.
    density: f32,
    /// How much of the way lies in the medium.
    distance: f32,
    /// The way may leave the medium through a clear border, once.
    leaves: bool,
    goes_on: bool,
}

impl Look {
    const NONE: Self = Self { sight: Sight::NONE, density: 0.0, distance: 0.0, leaves: false, goes_on: false };

    /// A way to the light that is all in one medium, or which `leaves` it.
    #[inline(always)]
    fn new(sight: Sight, light: &LightSample, leaves: bool) -> Self {
        let Connection { shadow, direction, .. } = sight.connection;
        let distance = shadow.t_max * dot(shadow.direction, direction);
        Self { sight, density: light.density, distance, leaves, goes_on: true }
    }

    /// Goes on behind a hit, if a body is left there. Nothing else is passed.
    #[inline(always)]
    fn behind(self, at: &Location, hit: &Hit, met: &Interior) -> Self {
        let Connection { shadow, direction, .. } = self.sight.connection;
        let origin = at.position + at.normal * at.offset;
        let end = shadow.origin + shadow.direction;
        let far = shadow.t_max >= Ray::FAR;
        let left = Ray { origin, direction: if far { shadow.direction } else { end - origin }, ..shadow };
        let connection = Connection { shadow: left, ..self.sight.connection };
        Self {
            sight: Sight { connection, ..self.sight },
            distance: hit.t * dot(shadow.direction, direction),
            leaves: false,
            goes_on: self.leaves & met.closed & met.is_clear() & (dot(at.normal, direction) > 0.0),
            ..self
        }
    }

    /// What the light adds to the path, where its way is open.
    #[inline(always)]
    fn value(&self) -> Vec3 {
        let Sight { connection, extinction, worth, .. } = self.sight;
        worth * next_event(self.density, &connection.through(extinction, self.distance))
    }
}

/// A light that was drawn for a vertex or a collision; whether it is seen from there is not known yet.
struct Sight {
    connection: Connection,
    /// Where it is seen from: a segment begins beside a surface.
    from: Vec3,
    /// Of the medium in between.
    extinction: Vec3,
    /// What light from there is worth at the path's beginning.
    worth: Vec3,
}

impl Sight {
    /// Nothing is seen.
    const NONE: Self =
        Self { connection: Connection::NONE, from: Vec3::ZERO, extinction: Vec3::ZERO, worth: Vec3::ZERO };

    /// What it adds to the path, where nothing lies on the way.
    #[inline(always)]
    fn value(&self, light: &LightSample) -> Vec3 {
        let distance = dot(light.position - self.from, self.connection.direction);
        self.worth * next_event(light.density, &self.connection.through(self.extinction, distance))
    }
}

impl Walker {
    /// Goes on until the path ends or waits. False if the device cut a loop short: what was found is then not the whole.
    #[inline(always)]
    pub(super) fn run<S: Trace + Surface + Lights, const CLEAR: bool>(
        &mut self,
        scene: &S,
        params: &MediaParams,
        rng: &Rng,
    ) -> bool {
        let mut around = Around::new(Interior::NONE, 0.0);
        // what is around a path that has waited is asked for again
        let mut resumes = self.entry.is_hit();
        let mut found = Orders { sum: self.radiance, counts: false };
        let last = self.steps + params.stretch;
        let (mut waits, mut cut) = (false, false);
        // a compiler knows the value of a loop's condition after it, even where a driver has cut the loop: rounds are counted beside it
        let (mut rounds, mut ended) = (0_u32, 0_u32);
        // with clear borders one round looks for a light, or two
        let mut look = Look::NONE;
        while (self.alive & !waits) | (CLEAR & look.goes_on) {
            rounds = rounds.wrapping_add(1);
            found.counts = self.counts(params);
            let looks = CLEAR & look.goes_on;
            let inside = around.interior.scatters() & !looks & !resumes;
            let flight = if inside { self.flight(&around, rng) } else { Flight::NONE };
            let key = if inside { Ray::random_key(scene.features(), flight.words.x) } else { self.walk.ray.key };
            let ray = Ray { t_max: flight.t + flight.margin, key, ..self.walk.ray };
            let ray = if looks { look.sight.connection.shadow } else { ray };
            let hit = if resumes { self.entry } else { scene.closest(&ray) };
            cut = hit.is_cut();
            let too_long = inside & (self.steps >= params.longest_walk);
            self.steps += inside as u32;
            let collides = inside & !(hit.is_hit() & (hit.t < flight.t));
            let arrives = hit.is_hit() & !collides;
            let met = if arrives { scene.interior(&entry(&hit)) } else { Interior::NONE };
            let met = Interior { lit: met.lit & (params.lights_inside != 0), ..met };
            // a clear border scatters nothing
            let lights = arrives & !resumes & !looks & !(CLEAR & met.closed & met.is_clear());
            // drawn here for both, for it takes much code
            let light = if (collides & around.interior.lit) | lights {
                scene.sample_light(self.light_numbers(collides, rng))
            } else {
                LightSample::NONE
            };
            let far = if collides { flight.distance } else { hit.t + around.lead };
            let worth = if inside { flight.channels.worth(far, collides) } else { Vec3::ONE };
            let mut sight = Sight::NONE;
            if cut | too_long {
                self.tally.cut = self.tally.cut.wrapping_add(too_long as u32);
                self.alive = false;
                look.goes_on = false;
            } else if looks {
                if hit.is_hit() {
                    look = look.behind(&scene.location(&hit), &hit, &met);
                } else {
                    Receiver::<S::Material>::add(&mut found, look.value());
                    look.goes_on = false;
                }
            } else if resumes {
                resumes = false;
                around.interior = met;
                // no light was sampled at the surface of a body that was left into it
                self.walk.chosen.alone = !met.lit | around.returns;
                around.returns = false;
            } else if collides {
                sight = self.collide::<CLEAR>(&mut around, &flight, &hit, worth, &light);
                waits = self.steps >= last;
            } else if arrives {
                sight = self.meet::<S, CLEAR>(scene, params, rng, (&hit, worth, &met, &light), &mut around, &mut found);
                resumes = around.returns;
            } else {
                self.walk.escape(scene, &mut found);
                self.alive = false;
            }
            let shines = sight.connection.shines();
            if CLEAR {
                // behind the border there is a segment more
                let leaves = (max_component(sight.extinction) > 0.0) & (self.walk.depth + 1 < params.path.max_depth);
                look = if shines { Look::new(sight, &light, leaves) } else { look };
            } else if shines && !scene.occluded(&sight.connection.shadow) {
                found.counts = self.counts(params);
                Receiver::<S::Material>::add(&mut found, sight.value(&light));
            }
            ended = if (self.alive & !waits) | (CLEAR & look.goes_on) { ended } else { rounds };
        }
        self.radiance = found.sum;
        !cut & (ended == rounds)
    }

    /// Whether light that has collided as often as the path counts.
    #[inline(always)]
    fn counts(&self, params: &MediaParams) -> bool {
        (self.order >= params.least_order) & (self.order <= params.most_order)
    }

    /// The random numbers of the light that is drawn for a collision, or for the surface at which a segment ends.
    #[inline(always)]
    fn light_numbers(&self, collides: bool, rng: &Rng) -> UVec4 {
        let numbers =
            if collides { Numbers::independent(rng, self.boundary()) } else { Numbers::at(rng, self.walk.depth + 1) };
        numbers.light()
    }

    #[inline(always)]
    fn flight(&self, around: &Around, rng: &Rng) -> Flight {
        let interior = &around.interior;
        let words = rng.hash(FLIGHT + self.steps);
        let channels = Channels::of_path(interior.extinction, self.walk.throughput, interior.albedo);
        let distance = channels.sample(Vec2::new(rng::unit(words.x), rng::unit(words.y)));
        let margin = num::max(interior.offset, max_abs(self.walk.ray.origin) * COLLISION_MARGIN);
        Flight { channels, distance, t: num::max(distance - around.lead, 0.0), margin, words }
    }

    /// Scatters at the end of a flight, where `light` may shine.
    #[inline(always)]
    fn collide<const CLEAR: bool>(
        &mut self,
        around: &mut Around,
        flight: &Flight,
        hit: &Hit,
        worth: Vec3,
        light: &LightSample,
    ) -> Sight {
        let interior = &around.interior;
        let nearest = if hit.is_hit() { num::max(hit.t - flight.margin, 0.0) } else { flight.t };
        let ray = self.walk.ray;
        let mut throughput = flush(self.walk.throughput * (interior.albedo * worth));
        let UVec4 { x, y, z, w } = flight.words;
        let turned = sample_henyey_greenstein(Vec2::new(rng::unit(z), rng::unit(w)), interior.anisotropy);
        let direction = normalize(Frame::new(ray.direction).to_world(turned));
        let origin = ray.origin + ray.direction * num::min(flight.t, nearest);
        let seen = connect_inside(origin, ray.direction, interior.anisotropy, CLEAR, light);
        let connection = Connection { scatter_pdf: storable(seen.scatter_pdf), ..seen };
        let sight = Sight { connection, from: origin, extinction: interior.extinction, worth: throughput };
        let pdf = interior.turn_scale * henyey_greenstein_shape(rng::unit(z), interior.anisotropy);
        let chosen = Chosen { pdf: storable(pdf), alone: !interior.lit };
        self.order += 1;
        self.tally.scatterings = self.tally.scatterings.wrapping_add(1);
        if self.order > ROULETTE_FROM {
            let survival = num::clamp(max_component(throughput) * interior.gain, MIN_SURVIVAL, 1.0);
            // of each word the lowest eight bits are left
            let left = (x << 24) | ((y & 0xff) << 16) | ((z & 0xff) << 8);
            self.alive = rng::unit(left) < survival;
            throughput *= num::recip(survival);
        }
        self.alive &= max_component(throughput) > 0.0;
        self.walk = Walk { ray: Ray { origin, direction, ..ray }, throughput, chosen, depth: self.walk.depth };
        *around = Around::new(*interior, 0.0);
        sight
    }

    /// Takes off what is lost on the way to a surface. Interiors that do not scatter absorb as in `path`, whatever is carried along.
    #[inline(always)]
    fn dim<M>(&mut self, features: u32, around: &Around, passed: Vec3, hit: &Hit, point: &SurfacePoint<M>) {
        let Walk { throughput, ray, .. } = self.walk;
        self.walk.throughput = if around.interior.scatters() {
            flush(throughput * passed)
        } else {
            through_interior(throughput, point, &ray, hit.t, features)
        };
    }

    /// What happens at a surface, behind whose front is `met`.
    #[inline(always)]
    fn meet<S: Trace + Surface + Lights, const CLEAR: bool>(
        &mut self,
        scene: &S,
        params: &MediaParams,
        rng: &Rng,
        (hit, passed, met, light): (&Hit, Vec3, &Interior, &LightSample),
        around: &mut Around,
        found: &mut Orders,
    ) -> Sight {
        let point = scene.surface(&self.walk.ray, hit);
        self.dim(scene.features(), around, passed, hit, &point);
        let here = around.interior;
        let inside = here.scatters();
        let front = dot(point.normal, self.walk.ray.direction) <= 0.0;
        let own = inside & met.closed & (met.body == here.body);
        let mut sight = Sight::NONE;
        if own & front {
            self.come_back(&point, around);
            return sight;
        }
        let nested = met.closed & (met.around != 0);
        let outside = if nested { Interior::UNKNOWN } else { Interior::NONE };
        let behind = if front { *met } else { outside };
        let there = if met.closed { behind } else { here };
        let far = hit.t + around.lead;
        self.walk.chosen.pdf *= passes(here.scattering(), far);
        if CLEAR & !inside & (around.lead > 0.0) {
            // of a direction that was chosen inside: per area here it is by the whole way
            let part = num::div(hit.t, far);
            self.walk.chosen.pdf *= part * part;
        }
        self.walk.arrive(scene, hit, &point, found);
        let boundary = own & !front;
        // the last segment may be a walk, which goes on after reflections from inside
        let last = self.walk.depth >= params.path.max_depth;
        self.alive = (!last | boundary) & (max_component(self.walk.throughput) > 0.0);
        let chosen = self.walk.chosen;
        let mut passed = false;
        if boundary & self.alive && self.is_mirrored(&here, &point, rng) {
            self.mirror(&point);
        } else if self.alive {
            let vertex = Vertex::new(&point, &self.walk.ray, scene.features());
            sight = self.look(&vertex, light, &point, (here, last & !boundary), (there, last));
            passed = self.bounce(scene.features(), params, rng, &vertex, inside);
            self.alive &= !(passed & last);
        }
        if passed & met.closed {
            self.entry = if front { entry(hit) } else { enclosing(met.around) };
        }
        let stays = boundary & !passed;
        let left = passed & inside & !there.scatters() & (params.ends_after_media != 0);
        self.leave(if passed { there } else { here }, &point, stays, around);
        around.returns = passed & nested & !front;
        if CLEAR & passed & inside & !front & met.closed & met.is_clear() {
            // straight on: the direction is that of the last collision, or surface
            self.walk.chosen = chosen;
            around.lead = far;
        }
        if left {
            self.walk.depth = params.path.max_depth.wrapping_sub(1);
        }
        sight
    }

    /// From the front of the body that the path is inside of: by rounding it had left without crossing the surface.
    #[inline(always)]
    fn come_back<M>(&mut self, point: &SurfacePoint<M>, around: &mut Around) {
        self.tally.leaks = self.tally.leaks.wrapping_add(1);
        self.walk.ray.origin = point.position - point.normal * point.offset;
        *around = Around { lead: 0.0, ..*around };
    }

    /// A light, as it shines at a vertex; of the side from which the path comes, and of the other one, what is there, and whether no path goes on there.
    #[inline(always)]
    fn look<B: ScatteringFunction, M>(
        &self,
        vertex: &Vertex<B>,
        light: &LightSample,
        point: &SurfacePoint<M>,
        here: (Interior, bool),
        there: (Interior, bool),
    ) -> Sight {
        let connection = vertex.connect(light);
        let behind = vertex.is_behind(connection.direction);
        let (through, ended) = if behind { there } else { here };
        let dark = ended | (through.scatters() & !through.lit);
        let value = if dark { Vec3::ZERO } else { connection.value };
        let connection = Connection { value, ..connection };
        Sight { connection, from: point.position, extinction: through.scattering(), worth: self.walk.throughput }
    }

    /// Draws the next direction; whether the path passes the surface.
    #[inline(always)]
    fn bounce<B: ScatteringFunction>(
        &mut self,
        features: u32,
        params: &MediaParams,
        rng: &Rng,
        vertex: &Vertex<B>,
        inside: bool,
    ) -> bool {
        // a walk may meet the boundary many times before the path is a segment longer
        let numbers =
            if inside { Numbers::independent(rng, self.boundary()) } else { Numbers::at(rng, self.walk.depth) };
        let roulette = params.path.flags.contains(PathFlags::ROULETTE);
        self.alive = self.walk.bounce(features, vertex, numbers.scatter(), roulette, || numbers.roulette()).alive;
        vertex.is_behind(self.walk.ray.direction)
    }

    /// The first of the dimensions of a vertex that a segment inside of a medium ends at.
    #[inline(always)]
    fn boundary(&self) -> u32 {
        BOUNDARY + self.steps.wrapping_mul(DIMENSIONS_PER_SEGMENT)
    }

    /// Whether the boundary mirrors light as if the outside was denser.
    #[inline(always)]
    fn is_mirrored<M>(&self, here: &Interior, point: &SurfacePoint<M>, rng: &Rng) -> bool {
        let index = here.denser_outside;
        let interface = Dielectric::new(index, num::recip(index), true);
        let cos = num::abs(dot(point.normal, self.walk.ray.direction));
        let reflected = interface.fresnel(cos, interface.bent(cos)).reflected;
        (index > 1.0) & (rng::unit(rng.hash(self.boundary() + LIGHT).x) < reflected)
    }

    /// Reflects the path from inside.
    #[inline(always)]
    fn mirror<M>(&mut self, point: &SurfacePoint<M>) {
        let along = dot(point.normal, self.walk.ray.direction);
        // of unit length but for roundings, which collisions correct
        let direction = self.walk.ray.direction - point.normal * (2.0 * along);
        let origin = point.position - point.normal * point.offset;
        self.walk.ray = Ray { origin, direction, ..self.walk.ray };
        self.walk.chosen.alone = true;
    }

    /// The path leaves a surface into `next`, or stays inside of the body whose boundary it met.
    #[inline(always)]
    fn leave<M>(&mut self, next: Interior, point: &SurfacePoint<M>, stays: bool, around: &mut Around) {
        let scatters = next.scatters();
        let cos = num::max(num::abs(dot(point.normal, self.walk.ray.direction)), GRAZING_COSINE);
        let lead = if scatters { num::div(point.offset, cos) } else { 0.0 };
        let reflections = if stays { around.reflections + 1 } else { 0 };
        let caught = self.alive & (reflections > MOST_REFLECTIONS);
        let enters = self.alive & scatters & !around.interior.scatters();
        self.tally.walks = self.tally.walks.wrapping_add(enters as u32);
        self.tally.cut = self.tally.cut.wrapping_add(caught as u32);
        self.alive &= !caught;
        // a walk with its reflections is one segment
        self.walk.depth -= stays as u32;
        self.walk.chosen.alone |= scatters & !next.lit;
        *around = Around { interior: next, lead, reflections, returns: false };
    }
}
