//! A path, vertex by vertex.

use restir_shared::geometry::{Hit, Ray};
use restir_shared::scene::{LightKind, LightSample, SceneView, SurfacePoint, Trace};
use restir_shared::{glam::Vec3, layout::TRIANGLE_WORDS, technique::path::PathParams, vec::dot};
use serde::Serialize;

use super::{Isolated, Source, params, trace};
use crate::replay::{Event, Recording};
use crate::{Error, buffers::SceneBuffers, render::Render, technique::explain::Place};

/// A sample of a pixel: its path and its radiance.
#[derive(Clone, Debug)]
pub struct Path {
    /// The camera's end of the path.
    pub origin: Vec3,
    /// Every hit, in order.
    pub vertices: Vec<Vertex>,
    /// The last segment, if it hit nothing.
    pub escape: Option<Escape>,
    /// The sample's radiance, as the film has it.
    pub radiance: Vec3,
}

/// A hit of a path.
#[derive(Clone, Debug, Serialize)]
pub struct Vertex {
    /// The triangle, in the order of the geometry arena.
    pub triangle: u32,
    /// Index of its material, as of the scene's list.
    pub material: u32,
    /// Index of the scene's instance it belongs to.
    pub instance: u32,
    /// Direction of the segment that ends here; it has unit length.
    pub direction: Vec3,
    /// Length of that segment.
    pub t: f32,
    /// World position.
    pub position: Vec3,
    /// Unit geometric normal of the front side.
    pub normal: Vec3,
    /// Density per steradian with which the vertex before chose the direction, to about six digits; zero at the first
    /// hit, infinite where emission has no other way to be found.
    pub scatter_pdf: f32,
    /// What a unit of radiance that leaves here towards the path adds to the sample.
    pub throughput: Vec3,
    /// Light that the surface itself emits.
    pub emission: Emission,
    /// The sampled light, if one was drawn here.
    pub light: Option<NextEvent>,
}

/// Emission that a path has hit.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Emission {
    /// Radiance towards the path.
    pub radiance: Vec3,
    /// Weight of having found it by scattering, against light sampling; 1 at the first hit.
    pub weight: f32,
    /// What it adds to the sample.
    pub contribution: Vec3,
}

/// A segment that leaves the scene.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Escape {
    /// Its direction; it has unit length.
    pub direction: Vec3,
    /// Radiance of the environment in that direction.
    pub radiance: Vec3,
    /// What it adds to the sample.
    pub contribution: Vec3,
}

/// A light sample, on an emitter or in the direction of one.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct NextEvent {
    /// The emitter's triangle; `None` if it has none.
    pub triangle: Option<u32>,
    /// Index of the emitter's material.
    pub material: Option<u32>,
    /// What it lies on.
    #[serde(skip)]
    pub kind: LightKind,
    /// World position; the direction towards a light at infinity.
    pub position: Vec3,
    /// Density with which it was drawn: per area on a surface, per steradian in the environment, else a probability.
    pub density: f32,
    /// Whether the light reaches the vertex; `None` if no ray was needed to know that it adds nothing.
    pub visible: Option<bool>,
    /// The triangle in between.
    pub blocker: Option<u32>,
    /// What it adds to the sample.
    pub contribution: Vec3,
}

impl Path {
    /// The sum of all contributions in the order in which the technique adds them.
    pub fn sum_of_parts(&self) -> Vec3 {
        let parts =
            self.vertices.iter().flat_map(|v| [Some(v.emission.contribution), v.light.map(|light| light.contribution)]);
        let parts = parts.chain([self.escape.map(|escape| escape.contribution)]).flatten();
        parts.fold(Vec3::ZERO, |sum, part| sum + part)
    }
}

/// Replays a sample natively.
///
/// # Errors
/// [`Error::Setting`] for a pixel outside of the image, and as of [`crate::render::check`].
pub fn explain_sample(scene: &SceneBuffers, render: &Render, place: Place) -> Result<Path, Error> {
    place.check(render)?;
    let Place { x, y, sample } = place;
    let view = scene.view();
    let replay = Replay { view: &view, params: params(scene, render, sample)?, x, y };
    Ok(replay.path())
}

struct Replay<'a> {
    view: &'a SceneView<'a>,
    params: PathParams,
    x: u32,
    y: u32,
}

impl Replay<'_> {
    fn path(&self) -> Path {
        let recording = Recording::new(self.view);
        let radiance = Vec3::from_array(trace(&recording, &self.params, self.x, self.y).sum);
        let mut path = Path { origin: Vec3::ZERO, vertices: Vec::new(), escape: None, radiance };
        let (mut segment, mut light_samples) = (None, 0);
        for event in recording.into_events() {
            match event {
                Event::Closest { ray, hit } => {
                    if segment.is_none() {
                        path.origin = ray.origin;
                    }
                    segment = Some((ray, hit));
                }
                Event::Environment(point) => {
                    path.escape = segment.map(|(ray, _)| Escape {
                        direction: ray.direction,
                        radiance: point.radiance,
                        contribution: self.only(Source::Environment),
                    });
                }
                Event::Surface(point) => {
                    let vertex = segment.map(|(ray, hit)| self.vertex(path.vertices.len() as u32, &ray, &hit, &point));
                    path.vertices.extend(vertex);
                }
                Event::LightDensity(_) => {}
                Event::LightSample(light) => {
                    if let Some(vertex) = path.vertices.last_mut() {
                        vertex.light = Some(self.next_event(light_samples, &light));
                    }
                    light_samples += 1;
                }
                Event::Occluded { ray, occluded } => {
                    let blocker = occluded.then(|| self.view.closest(&ray)).filter(Hit::is_hit).map(|hit| hit.id);
                    if let Some(light) = path.vertices.last_mut().and_then(|vertex| vertex.light.as_mut()) {
                        (light.visible, light.blocker) = (Some(!occluded), blocker);
                    }
                }
            }
        }
        path
    }

    /// The sample's radiance if only `source` shone.
    fn only(&self, source: Source) -> Vec3 {
        Vec3::from_array(trace(&Isolated::new(self.view, source), &self.params, self.x, self.y).sum)
    }

    fn vertex(&self, index: u32, ray: &Ray, hit: &Hit, point: &SurfacePoint) -> Vertex {
        let (material, instance) = self.owner(hit.id);
        let throughput = self.only(Source::Unit { vertex: index, density: 0.0 });
        let density = restir_shared::scene::Lights::light_density(self.view, hit);
        Vertex {
            triangle: hit.id,
            material,
            instance,
            direction: ray.direction,
            t: hit.t,
            position: point.position,
            normal: point.normal,
            scatter_pdf: if index == 0 { 0.0 } else { self.scatter_pdf(index, ray, hit, point, throughput) },
            throughput,
            emission: Emission {
                radiance: point.emission,
                weight: self.weight(index, density, throughput),
                contribution: self.only(Source::Emission(index)),
            },
            light: None,
        }
    }

    /// The weight that emission would have at a vertex, were `density` that of light sampling.
    fn weight(&self, vertex: u32, density: f32, throughput: Vec3) -> f32 {
        let weighted = self.only(Source::Unit { vertex, density });
        let channel = throughput.max_position();
        let [weighted, whole] = [weighted, throughput].map(|radiance| f64::from(radiance[channel]));
        if whole > 0.0 { (weighted / whole) as f32 } else { 1.0 }
    }

    /// From the weight w = s / (s + l), where s is the density times the cosine and l the light's density times t²: the
    /// first l is a guess, the second makes the weight about a half, where it tells most.
    fn scatter_pdf(&self, vertex: u32, ray: &Ray, hit: &Hit, point: &SurfacePoint, throughput: Vec3) -> f32 {
        let squared = f64::from(hit.t) * f64::from(hit.t);
        let mut scatter = 1.0;
        for _ in 0..2 {
            let density = (scatter / squared) as f32;
            let weight = f64::from(self.weight(vertex, density, throughput));
            scatter = f64::from(density) * squared * weight / (1.0 - weight);
        }
        (scatter / f64::from(dot(point.normal, ray.direction)).abs()) as f32
    }

    fn next_event(&self, index: u32, light: &LightSample) -> NextEvent {
        let triangle = self.triangle_below(light);
        NextEvent {
            triangle,
            material: triangle.map(|triangle| self.owner(triangle).0),
            kind: light.kind,
            position: light.position,
            density: light.density,
            visible: None,
            blocker: None,
            contribution: self.only(Source::LightSample(index)),
        }
    }

    /// The triangle that a point was drawn on: the nearest to the point, seen from just above it.
    fn triangle_below(&self, light: &LightSample) -> Option<u32> {
        if light.kind != LightKind::Area {
            return None;
        }
        let ray = Ray {
            origin: light.position + light.normal * light.offset,
            direction: -light.normal,
            t_max: 2.0 * light.offset,
        };
        Some(self.view.closest(&ray)).filter(Hit::is_hit).map(|hit| hit.id)
    }

    /// Material and instance of a triangle.
    fn owner(&self, triangle: u32) -> (u32, u32) {
        let at = (self.view.header.triangle_base + triangle * TRIANGLE_WORDS) as usize;
        let word = |i: usize| self.view.geometry.get(at + i).map_or(0, |word| word.w);
        (word(0), word(2))
    }
}
