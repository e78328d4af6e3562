//! What follows vertex k in a scene that has changed: traced once more by the path's own random numbers.
//!
//! A path that keeps what arrives at its vertex k, and not the light, says nothing of the way that the light has taken. Its random numbers do:
//! from vertex k on, in the stored direction, they give one path in each frame's scene. That is a shift by replay of these numbers, of a Jacobian
//! of 1, and it is undone by the same function with the frames exchanged. Whether the path may be joined at vertex k is nothing to it, for that
//! is asked of what leads there and of the direction.

use super::recall::recalled;
use super::record::PackedPath;
use super::{PathNumbers, PtParams};
use crate::bsdf::ScatteringFunction;
use crate::geometry::{Hit, Ray};
use crate::resample::params::Flags;
use crate::scene::{AddressedLights, BsdfOf, Frames, Lights, Surface, SurfacePoint, Trace};
use crate::shift::{Numbers, Path};
use crate::transport::{Chosen, Departure, Vertex, emission_weight, environment_weight, next_event, through_interior};
use crate::vec::{dot, flush, max_component};
use glam::Vec3;

/// A path of the other frame as it is in a scene that has changed since, as [`recall`](super::recall) has it, with what arrives at vertex k
/// now. With [`Flags::BACK`] it is a path of this frame, which gets what arrived there in the other one; the rest is for the shift to take there.
/// Where nothing arrives it has a term of 0.
#[inline(always)]
pub fn retrace<F: Frames>(frames: &F, params: &PtParams, packed: PackedPath) -> PackedPath {
    let back = params.has(Flags::BACK);
    let mut path = packed.unpack().path;
    if path.keeps_arrival() & (path.length != 0) & (path.term > 0.0) {
        let numbers = PathNumbers::of_key(path.key, params.seed, params.flags.sampler());
        path.radiance = arriving(&frames.scene(back), &numbers, &path);
        path.term = if max_component(path.radiance) > 0.0 { path.term } else { 0.0 };
    }
    if back { packed.carried(&path, path.term) } else { recalled(frames, params, packed, path) }
}

/// What arrives at vertex k of a path in the direction in which it leaves it, by its random numbers: black if that is no path of its length and
/// kind in this scene. In the scene in which it was found it is [`Path::radiance`], to the bit if its hit and direction are those that were traced.
///
/// The path keeps what arrives ([`Path::keeps_arrival`]). Blended surfaces are nothing for paths that are joined.
#[inline(always)]
pub fn arriving<S: Trace + Surface + AddressedLights>(scene: &S, numbers: &PathNumbers, path: &Path) -> Vec3 {
    let mut end = Tip::new(scene, path);
    while end.open {
        let hit = scene.closest(&end.ray);
        end.vertex += 1;
        if hit.is_hit() {
            let point = scene.surface(&end.ray, &hit);
            end.throughput = through_interior(end.throughput, &point, &end.ray, hit.t, scene.features());
            if end.vertex == path.length {
                end.emit(scene, &point, &hit);
            } else {
                let vertex = Vertex::new(&point, &end.ray, scene.features());
                end.scatter(scene, numbers, path, &vertex);
            }
        } else {
            end.escape(scene, path, &hit);
        }
    }
    end.arrives
}

/// The end of what grows from vertex k.
struct Tip {
    ray: Ray,
    /// The index of the vertex that the ray leaves.
    vertex: u32,
    throughput: Vec3,
    chosen: Chosen,
    open: bool,
    arrives: Vec3,
}

impl Tip {
    #[inline(always)]
    fn new<S: Surface>(scene: &S, path: &Path) -> Self {
        let joint = scene.location(&path.hit);
        let behind = dot(joint.normal, path.direction) < 0.0;
        let offset = if behind { -joint.offset } else { joint.offset };
        Self {
            ray: Ray {
                origin: joint.position + joint.normal * offset,
                direction: path.direction,
                t_max: Ray::FAR,
                key: 0,
            },
            vertex: path.reconnection,
            throughput: Vec3::ONE,
            // no light that is found next counts: vertex k + 1 is not the last one
            chosen: Chosen::NONE,
            open: true,
            arrives: Vec3::ZERO,
        }
    }

    /// Goes no further: this is the light.
    #[inline(always)]
    fn find(&mut self, radiance: Vec3) {
        self.open = false;
        self.arrives = self.throughput * radiance;
    }

    /// Scattering has reached the last vertex.
    #[inline(always)]
    fn emit<S: Lights, M>(&mut self, scene: &S, point: &SurfacePoint<M>, hit: &Hit) {
        let weight = emission_weight(scene.light_density(hit), point, &self.ray, hit.t, self.chosen);
        self.find(point.emission * weight);
    }

    /// The ray hits nothing, or the device has cut a loop short.
    #[inline(always)]
    fn escape<S: Lights>(&mut self, scene: &S, path: &Path, hit: &Hit) {
        self.open = false;
        if (self.vertex == path.length) & !path.light_sampled & !hit.is_cut() {
            let environment = scene.environment(self.ray.direction);
            let weight = environment_weight(environment.density, self.chosen);
            self.find(environment.radiance * weight);
        }
    }

    /// Samples the light, if the path ends so, or goes on.
    #[inline(always)]
    fn scatter<S: Trace + Surface + Lights>(
        &mut self,
        scene: &S,
        numbers: &PathNumbers,
        path: &Path,
        vertex: &Vertex<BsdfOf<S>>,
    ) {
        if path.light_sampled & (self.vertex + 1 == path.length) {
            return self.sample(scene, numbers, vertex);
        }
        let Departure { sample, ray, alive, .. } = vertex.depart(numbers.scatter(self.vertex), scene.features());
        self.chosen = Chosen { pdf: sample.pdf, alone: sample.delta };
        self.throughput = flush(self.throughput * sample.weight);
        self.ray = ray;
        self.open = alive & (max_component(self.throughput) > 0.0);
    }

    /// The path ends with a light that is sampled at the vertex.
    #[inline(always)]
    fn sample<S: Trace + Surface + Lights>(&mut self, scene: &S, numbers: &PathNumbers, vertex: &Vertex<BsdfOf<S>>) {
        self.open = false;
        let light = scene.sample_light(numbers.light(self.vertex));
        let connection = vertex.connect(&light);
        let arrives = vertex.bsdf.has_smooth_part() && max_component(connection.value) > 0.0;
        let scattered = next_event(light.density, &connection);
        if arrives && !scene.occluded(&connection.shadow) {
            self.find(scattered);
        }
    }
}
