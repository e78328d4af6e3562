//! The hybrid shift: one loop over the vertices of a path, with one call site for each thing that is asked of a scene.

use super::join::{End, Hybrid, Joins};
use super::{KeptPath, Path, PathOrigin};
use crate::bsdf::ScatteringFunction;
use crate::geometry::{Hit, Ray};
use crate::layout::FEATURE_VOLUME;
use crate::num;
use crate::resample::mutual::{Cause, Shifted};
use crate::scene::{
    AddressedLight, AddressedLights, BsdfOf, LightKind, LightSample, Lights, Surface, SurfacePoint, Trace,
};
use crate::transport::{
    Chosen, Connection, Departure, Vertex, emission_weight, environment_weight, next_event, through_interior,
};
use crate::vec::{dot, flush, max_component};
use glam::{UVec4, Vec3};

/// The random numbers of a path. They do not depend on where it begins.
pub trait Numbers {
    /// The numbers by which the path leaves the vertex of that index.
    fn scatter(&self, vertex: u32) -> UVec4;
    /// The numbers that vary the thresholds of [`Hybrid`].
    fn joins(&self) -> UVec4;
}

/// Shifts a path to an `origin`, whose hit is one. Where the scene has `changed` since the path was found, something may lie between
/// vertex k and its light by now.
#[inline(always)]
pub fn shift<S: Trace + Surface + AddressedLights, N: Numbers>(
    scene: &S,
    numbers: &N,
    hybrid: &Hybrid,
    origin: &PathOrigin,
    kept: &impl KeptPath,
    changed: bool,
) -> Shifted {
    let course = kept.course();
    let replays = course.last_replayed().wrapping_sub(1);
    let shiftable = (course.term > 0.0) & (course.length >= 2) & (replays <= hybrid.replays);
    if !shiftable {
        return Shifted::failed(Cause::Unshiftable);
    }
    let mut end = Tip::new(origin, changed);
    let mut joins = hybrid.of_path(numbers.joins());
    while end.open {
        let point = scene.surface(&end.ray, &end.hit);
        if end.vertex == 1 {
            joins = joins.at_origin(end.hit.t, num::abs(dot(point.normal, end.ray.direction)));
        }
        end.throughput = through_interior(end.throughput, &point, &end.ray, end.hit.t, scene.features());
        if end.vertex == course.length {
            end.emit(scene, &joins, &point);
        } else {
            let vertex = Vertex::new(&point, &end.ray, scene.features());
            let cos = vertex.cos(end.ray.direction);
            if end.vertex < course.last_replayed() {
                end.replay(scene, numbers, &joins, course.length, &vertex, cos);
            } else {
                end.join(scene, &joins, kept, &vertex, cos);
            }
        }
    }
    end.shifted()
}

/// The end of a path that grows.
struct Tip {
    /// Where it is: the hit of the ray, of which the direction and the distance count.
    ray: Ray,
    hit: Hit,
    /// The index of that vertex.
    vertex: u32,
    throughput: Vec3,
    term: f32,
    /// The vertex before, as the end of the segment that leads here.
    from: End,
    chosen: Chosen,
    /// What lies behind vertex k is not what it was.
    changed: bool,
    open: bool,
    cause: Cause,
}

impl Tip {
    const NONE: Self = Self {
        ray: Ray::NONE,
        hit: Hit::MISS,
        vertex: 0,
        throughput: Vec3::ZERO,
        term: 0.0,
        from: End::NONE,
        chosen: Chosen::NONE,
        changed: false,
        open: false,
        cause: Cause::Unshiftable,
    };

    #[inline(always)]
    fn new(origin: &PathOrigin, changed: bool) -> Self {
        let hit = origin.hit.unpack();
        Self {
            ray: origin.ray(),
            hit,
            vertex: 1,
            throughput: Vec3::ONE,
            term: 1.0,
            from: End::NONE,
            chosen: Chosen::NONE,
            changed,
            open: hit.is_hit(),
            cause: if hit.is_hit() { Cause::Nothing } else { Cause::Unshiftable },
        }
    }

    /// Goes no further, with `cause` if this is no path.
    #[inline(always)]
    fn end(&mut self, cause: Cause) {
        self.open = false;
        self.cause = cause;
    }

    /// This is no path. Constants stand for all that was known of it: else registers keep it on all other ways through the loop, too. What
    /// never changes takes none.
    #[inline(always)]
    fn fail(&mut self, cause: Cause) {
        let changed = self.changed;
        *self = Self { changed, cause, ..Self::NONE };
    }

    #[inline(always)]
    fn shifted(&self) -> Shifted {
        let least = max_component(self.throughput);
        let sound = (least > 0.0) & (least < BRIGHTEST) & (self.term > num::FLUSH_BELOW) & (self.term < BRIGHTEST);
        if self.cause != Cause::Nothing {
            Shifted::failed(self.cause)
        } else if sound {
            Shifted { value: self.throughput, term: self.term, cause: Cause::Nothing }
        } else {
            Shifted::failed(Cause::Broken)
        }
    }

    /// Whether the segment that leads here may be joined, of a path that leaves here as `to` says.
    #[inline(always)]
    fn joins(&self, joins: &Joins, to: &End) -> bool {
        (self.vertex > 1) & joins.surfaces(&self.from, to, self.hit.t * self.hit.t)
    }

    /// Replays how the path left the vertex, up to the next one.
    #[inline(always)]
    fn replay<S: Trace + Surface + AddressedLights, N: Numbers>(
        &mut self,
        scene: &S,
        numbers: &N,
        joins: &Joins,
        length: u32,
        vertex: &Vertex<BsdfOf<S>>,
        cos: f32,
    ) {
        let Departure { sample, ray, alive, roughness, cos: cos_out } =
            vertex.depart(numbers.scatter(self.vertex), scene.features());
        let leaves = End { roughness, pdf: sample.pdf, cos };
        self.throughput = flush(self.throughput * sample.weight);
        if !(alive & (max_component(self.throughput) > 0.0)) {
            return self.fail(Cause::Replay);
        }
        if self.joins(joins, &leaves) {
            return self.fail(Cause::Joins);
        }
        self.from = End { cos: cos_out, ..leaves };
        self.chosen = Chosen { pdf: sample.pdf, alone: sample.delta };
        self.ray = ray;
        self.hit = scene.closest(&ray);
        self.vertex += 1;
        if self.hit.is_cut() {
            self.fail(Cause::Broken);
        } else if !self.hit.is_hit() {
            self.escape(scene, joins, length);
        }
    }

    /// Random replay has ended in the void.
    #[inline(always)]
    fn escape<S: Lights>(&mut self, scene: &S, joins: &Joins, length: u32) {
        let environment = scene.environment(self.ray.direction);
        let weight = environment_weight(environment.density, self.chosen);
        self.throughput = self.throughput * environment.radiance * weight;
        let found = (self.vertex == length) & (max_component(self.throughput) > 0.0);
        let joined = joins.light(&self.from, 1.0, 1.0, true);
        self.end(if !found {
            Cause::Replay
        } else if joined {
            Cause::Joins
        } else {
            Cause::Nothing
        });
    }

    /// Random replay has reached the vertex where the path has its light.
    #[inline(always)]
    fn emit<S: Lights, M>(&mut self, scene: &S, joins: &Joins, point: &SurfacePoint<M>) {
        let t = self.hit.t;
        let weight = emission_weight(scene.light_density(&self.hit), point, &self.ray, t, self.chosen);
        self.throughput = self.throughput * point.emission * weight;
        let cos = num::abs(dot(point.normal, self.ray.direction));
        self.end(if max_component(self.throughput) <= 0.0 {
            Cause::Replay
        } else if joins.light(&self.from, cos, t * t, false) {
            Cause::Joins
        } else {
            Cause::Nothing
        });
    }

    /// Joins what the path keeps: its reconnection vertex or, from there, what follows.
    #[inline(always)]
    fn join<S: Trace + Surface + AddressedLights>(
        &mut self,
        scene: &S,
        joins: &Joins,
        kept: &impl KeptPath,
        vertex: &Vertex<BsdfOf<S>>,
        cos: f32,
    ) {
        let Path { length, reconnection, light_sampled, lobes, .. } = kept.course();
        let at_joint = self.vertex == reconnection;
        let lights = self.vertex + 1 == length;
        let lobe = if at_joint { lobes[1] } else { lobes[0] };
        let next = Next::of(scene, kept, at_joint, lights);
        let connection = vertex.connect_by(&next.sample, lobe);
        if max_component(connection.value) <= 0.0 || next.is_hidden(&connection) {
            return self.fail(Cause::Dark);
        }
        let drawn = lights & light_sampled;
        let roughness = if drawn { vertex.bsdf.greatest_roughness() } else { vertex.bsdf.roughness(lobe) };
        let leaves = End { roughness, pdf: connection.scatter_pdf, cos };
        let away = End { cos: vertex.cos(connection.direction), ..leaves };
        let wrong = (self.joins(joins, &leaves) != at_joint)
            | (lights & !at_joint & !drawn & !next.joins(joins, &away, &connection));
        if wrong {
            return self.fail(Cause::Joins);
        }
        self.throughput = flush(self.throughput * next_event(next.density, &connection));
        let density = if drawn { next.density } else { connection.lobe_pdf * connection.per_area() };
        self.term *= density * next.extent;
        // whatever comes next, nothing of this vertex is kept while a ray is traced
        self.from = away;
        self.chosen = Chosen::NONE;
        self.ray = Ray { direction: connection.direction, ..connection.shadow };
        self.hit = Hit { t: num::sqrt(connection.distance_squared), ..Hit::MISS };
        self.vertex += 1;
        let ends = lights | at_joint;
        // of what arrives at vertex k only a light has a place that a ray can ask for
        let asked = !at_joint | (lights & self.changed);
        if asked && scene.occluded(&connection.shadow) {
            self.fail(Cause::Blocked);
        } else if self.term <= 0.0 || !ends && max_component(self.throughput) <= 0.0 {
            self.fail(Cause::Dark);
        } else if ends {
            self.end(Cause::Nothing);
        } else {
            self.hit = Hit { t: self.hit.t, ..kept.path().hit };
        }
    }
}

/// Numbers beyond are out of range.
const BRIGHTEST: f32 = 1.0e30;

/// Where a path goes to: a light, a surface as if it shone, or a direction.
struct Next {
    sample: LightSample,
    /// With which light sampling could have found it; 0 if it is no light.
    density: f32,
    extent: f32,
    /// Light from the back of the surface is like light from the front.
    solid: bool,
}

impl Next {
    /// What the path goes to from the vertex where it is joined, or from the one before.
    #[inline(always)]
    fn of<S: Surface + AddressedLights>(scene: &S, kept: &impl KeptPath, at_joint: bool, lights: bool) -> Self {
        let surface = |sample| Self { sample, density: 0.0, extent: 1.0, solid: true };
        if lights {
            let Path { light, light_sampled, .. } = kept.path();
            let AddressedLight { sample, extent } = scene.light_at(light);
            let solid = (scene.features() & FEATURE_VOLUME == 0) | light_sampled;
            Self { sample, density: sample.density, extent, solid }
        } else if at_joint {
            let Path { direction, radiance, .. } = kept.path();
            surface(LightSample {
                position: direction,
                emission: radiance,
                density: 1.0,
                kind: LightKind::Environment,
                ..LightSample::NONE
            })
        } else {
            surface(LightSample::surface(&scene.location(&kept.path().hit)))
        }
    }

    /// Scattering that arrives at the back of an emitter has passed an interior, of which its address knows nothing.
    #[inline(always)]
    fn is_hidden(&self, connection: &Connection) -> bool {
        !self.solid & (self.sample.kind == LightKind::Area) & (dot(self.sample.normal, connection.direction) > 0.0)
    }

    /// Whether the segment to this light may be joined.
    #[inline(always)]
    fn joins(&self, joins: &Joins, from: &End, connection: &Connection) -> bool {
        joins.light(from, connection.cos_light, connection.distance_squared, self.sample.at_infinity())
    }
}
