//! What a traced path finds, as paths that can be shifted: one for each time that it finds light.

use super::PathNumbers;
use crate::bsdf::{Scattering, ScatteringFunction};
use crate::geometry::Hit;
use crate::layout::FEATURE_VOLUME;
use crate::num;
use crate::resample::similar::{GBufferSurface, PackedSurface};
use crate::scene::{AddressedLight, AddressedLights, EnvironmentPoint, LightSample, Surface, SurfacePoint};
use crate::shift::{End, Joins, Path, PathOrigin};
use crate::technique::path::{Receiver, Walk};
use crate::transport::{Connection, Departure, Vertex, through_interior};
use crate::vec::{dot, flush};
use glam::{UVec2, Vec3};

/// A path to a light, before the light's address is known.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// The path.
    pub path: Path,
    /// Where scattering found the light: the hit of an emitter, or none for the environment in the path's direction.
    pub emitter: Hit,
}

impl Candidate {
    /// No candidate.
    pub const NONE: Self = Self { path: Path::NONE, emitter: Hit::MISS };

    /// The path with its light's address, and the light's part in the term.
    #[inline(always)]
    pub fn path<S: AddressedLights>(&self, scene: &S, numbers: &PathNumbers) -> Path {
        let mut path = self.path;
        if path.keeps_light() {
            path.light = if path.light_sampled {
                scene.choose_address(numbers.light(path.length - 1))
            } else if self.emitter.is_hit() {
                scene.address_of_hit(&self.emitter)
            } else {
                scene.address_of_environment(path.direction)
            };
            let AddressedLight { sample, extent } = scene.light_at(path.light);
            path.term *= if path.light_sampled { sample.density * extent } else { extent };
        }
        path
    }
}

/// Takes candidates.
pub trait Keep {
    /// Takes the whole contribution of a path, and the path.
    fn candidate(&mut self, value: Vec3, candidate: &Candidate);
    /// Takes what the first segment finds: it is no path from the first vertex on.
    fn direct(&mut self, value: Vec3);
}

/// Makes candidates of what a path finds: one that is traced from the camera or, a `SUFFIX`, from an origin that is known.
#[derive(Debug)]
pub struct Candidates<K, const SUFFIX: bool = false> {
    /// Takes them.
    pub keep: K,
    /// Where the path begins.
    pub origin: PathOrigin,
    /// The surface there.
    pub surface: PackedSurface,
    features: u32,
    joins: Joins,
    /// The path does not begin on an edge.
    off_edges: bool,
    /// The candidate as far as it is known: with a reconnection vertex, once the path has passed one.
    begun: Path,
    /// Throughput since the reconnection vertex.
    beyond: Vec3,
    /// The index of the last vertex, its hit, and the segment that led there.
    vertex: u32,
    hit: Hit,
    cos: f32,
    /// Light from the back of an emitter is like light from the front.
    solid: bool,
    /// The vertex before, as the end of that segment, the lobe by which the path left it and that lobe's density.
    from: End,
    lobe: u32,
    lobe_pdf: f32,
    /// The roughness of the last vertex, of any lobe.
    roughness: f32,
    /// Whether the segment to the last vertex may be joined, if the path ends there with a sampled light.
    joined: bool,
}

impl<K, const SUFFIX: bool> Candidates<K, SUFFIX> {
    /// The candidates of a path with these random numbers and thresholds, in a scene of these features. `off_edges` asks for paths that begin
    /// beside edges ([`Surface::off_edges`]): rays through the same point of every pixel may be made to meet them. Paths begin at `origin`, if there is one,
    /// else where their first ray ends.
    #[inline(always)]
    pub fn new(keep: K, features: u32, key: UVec2, joins: Joins, off_edges: bool, origin: PathOrigin) -> Self {
        Self {
            keep,
            origin,
            surface: PackedSurface::NONE,
            features,
            joins,
            off_edges,
            begun: Path { key, term: 1.0, ..Path::NONE },
            beyond: Vec3::ONE,
            vertex: 0,
            hit: Hit::MISS,
            cos: 1.0,
            solid: true,
            from: End::NONE,
            lobe: 0,
            lobe_pdf: 0.0,
            roughness: 0.0,
            joined: false,
        }
    }

    #[inline(always)]
    fn passed_joint(&self) -> bool {
        self.begun.reconnection != 0
    }

    /// Solid angle at the vertex before, per area at the last one.
    #[inline(always)]
    fn per_area(&self) -> f32 {
        num::div(self.cos, self.hit.t * self.hit.t)
    }

    /// Scattering has found light at the vertex of that index: on the last hit, or at infinity.
    #[inline(always)]
    fn found(&self, length: u32, radiance: Vec3, direction: Vec3, emitter: Hit) -> Candidate {
        let far = !emitter.is_hit();
        let next = self.begun.reconnection + 1 == length;
        let joins = self.joins.light(&self.from, self.cos, emitter.t * emitter.t, far);
        let spread = if far { 1.0 } else { self.per_area() };
        let begun = Path { length, ..self.begun };
        let path = if self.passed_joint() {
            let term = if next { begun.term * spread } else { begun.term };
            Path { term, radiance: self.beyond * radiance, ..begun }
        } else if joins {
            let term = self.lobe_pdf * spread;
            Path { reconnection: length, lobes: [self.lobe, 0], direction, term, ..begun }
        } else {
            begun
        };
        // the address of an emitter does not tell what an interior has absorbed
        let known = self.solid | far | !path.keeps_light();
        Candidate { path: Path { term: if known { path.term } else { 0.0 }, ..path }, emitter }
    }
}

impl<M: Scattering, K: Keep, const SUFFIX: bool> Receiver<M> for Candidates<K, SUFFIX> {
    #[inline(always)]
    fn add(&mut self, value: Vec3) {
        self.keep.direct(value);
    }

    #[inline(always)]
    fn begins_at(&self) -> Hit {
        if SUFFIX { self.origin.hit.unpack() } else { Hit::MISS }
    }

    /// Many rays go from the first vertex: those that are traced, and those by which paths of other pixels are joined to it. Both have
    /// to find the same, which on an edge they do not.
    #[inline(always)]
    fn place<S: Surface<Material = M>>(&mut self, scene: &S, walk: &Walk, hit: Hit) -> Hit {
        if self.off_edges & (walk.depth == 0) { scene.off_edges(&hit) } else { hit }
    }

    #[inline(always)]
    fn arrive(&mut self, walk: &Walk, hit: &Hit, point: &SurfacePoint<M>) {
        let cos = dot(point.normal, walk.ray.direction);
        self.vertex = walk.depth + 1;
        self.hit = *hit;
        self.cos = num::abs(cos);
        self.solid = (self.features & FEATURE_VOLUME == 0) | (cos <= 0.0);
        self.beyond = through_interior(self.beyond, point, &walk.ray, hit.t, self.features);
        if self.vertex == 1 {
            self.origin = if SUFFIX { self.origin } else { PathOrigin::new(&walk.ray, hit) };
            let (position, normal) = (point.position, point.normal);
            self.surface = PackedSurface::pack(&GBufferSurface { position, normal, distance: hit.t });
            self.joins = self.joins.at_origin(hit.t, self.cos);
        }
    }

    #[inline(always)]
    fn emission(&mut self, radiance: Vec3, weight: f32, value: Vec3) {
        if self.vertex == 1 {
            self.keep.direct(value);
        } else {
            let candidate = self.found(self.vertex, radiance * weight, self.begun.direction, self.hit);
            self.keep.candidate(value, &candidate);
        }
    }

    #[inline(always)]
    fn scatter(&mut self, vertex: &Vertex<M::Bsdf>) {
        self.roughness = vertex.bsdf.greatest_roughness();
    }

    #[inline(always)]
    fn light(&mut self, _light: &LightSample, connection: &Connection) {
        let leaves = End { roughness: self.roughness, pdf: connection.scatter_pdf, cos: self.cos };
        self.joined = (self.vertex > 1) & self.joins.surfaces(&self.from, &leaves, self.hit.t * self.hit.t);
    }

    #[inline(always)]
    fn next_event(&mut self, scattered: Vec3, value: Vec3) {
        let begun = Path { length: self.vertex + 1, light_sampled: true, ..self.begun };
        let path = if self.passed_joint() {
            Path { radiance: self.beyond * scattered, ..begun }
        } else if self.joined {
            let term = self.lobe_pdf * self.per_area();
            Path { reconnection: self.vertex, lobes: [self.lobe, 0], hit: self.hit, term, ..begun }
        } else {
            Path { reconnection: begun.length, ..begun }
        };
        self.keep.candidate(value, &Candidate { path, emitter: Hit::MISS });
    }

    #[inline(always)]
    fn depart(&mut self, departure: &Departure) {
        let Departure { sample, ray, roughness, cos, .. } = *departure;
        let leaves = End { roughness, pdf: sample.pdf, cos: self.cos };
        if self.passed_joint() {
            self.beyond = flush(self.beyond * sample.weight);
        } else if (self.vertex > 1) & self.joins.surfaces(&self.from, &leaves, self.hit.t * self.hit.t) {
            self.begun = Path {
                reconnection: self.vertex,
                lobes: [self.lobe, sample.lobe],
                hit: self.hit,
                direction: ray.direction,
                term: (self.lobe_pdf * self.per_area()) * sample.lobe_pdf,
                ..self.begun
            };
            self.beyond = Vec3::ONE;
        }
        self.from = End { cos, ..leaves };
        self.lobe = sample.lobe;
        self.lobe_pdf = sample.lobe_pdf;
    }

    #[inline(always)]
    fn escape(&mut self, walk: &Walk) {
        self.vertex = walk.depth + 1;
        self.hit = Hit::MISS;
        if !self.passed_joint() {
            self.begun.direction = walk.ray.direction;
        }
    }

    #[inline(always)]
    fn environment(&mut self, environment: &EnvironmentPoint, weight: f32, value: Vec3) {
        if self.vertex == 1 {
            self.keep.direct(value);
        } else {
            let candidate = self.found(self.vertex, environment.radiance * weight, self.begun.direction, Hit::MISS);
            self.keep.candidate(value, &candidate);
        }
    }
}
