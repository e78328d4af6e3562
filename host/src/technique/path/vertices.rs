//! A path, vertex by vertex.

use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::Vec3;
use restir_shared::layout::FEATURE_ALPHA;
use restir_shared::scene::{EnvironmentPoint, LightKind, LightSample, SceneView, SurfacePoint, Trace};
use restir_shared::technique::path::{self, Receiver, Walk};
use restir_shared::transport::Connection;
use serde::Serialize;

use super::params;
use crate::Error;
use crate::buffers::{SceneBuffers, owner};
use crate::render::Render;
use crate::technique::explain::Place;

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
    /// Density per steradian with which the vertex before chose the direction; zero at the first hit, infinite where
    /// emission has no other way to be found.
    pub scatter_pdf: f32,
    /// What a unit of radiance that leaves here towards the path adds to the sample.
    pub throughput: Vec3,
    /// Light that the surface itself emits, if it does.
    pub emission: Option<Emission>,
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
        let parts = self.vertices.iter().flat_map(|v| {
            [v.emission.map(|e| e.contribution), v.light.map(|light| light.contribution)].into_iter().flatten()
        });
        let parts = parts.chain(self.escape.map(|escape| escape.contribution));
        parts.fold(Vec3::ZERO, |sum, part| sum + part)
    }
}

/// Replays a sample natively.
///
/// # Errors
/// [`Error::Pixel`] for one outside of the image, and as of [`Render::check`].
pub fn explain_sample(scene: &SceneBuffers, render: &Render, place: Place) -> Result<Path, Error> {
    place.check(render)?;
    let Place { x, y, sample } = place;
    let view = SceneView { features: render.technique.integral().features(scene.features), ..scene.view() };
    let params = params(scene, render, sample)?;
    let radiance = Vec3::from_array(path::pixel(&view, &params, x, y).sum);
    let path = Path { origin: Vec3::ZERO, vertices: Vec::new(), escape: None, radiance };
    let mut writer = Writer { view: &view, path };
    path::trace(&view, &params, [x, y], sample, &mut writer);
    Ok(writer.path)
}

/// Writes down what a path finds.
struct Writer<'a> {
    view: &'a SceneView<'a>,
    path: Path,
}

impl Writer<'_> {
    fn begin(&mut self, walk: &Walk) {
        if walk.depth == 0 {
            self.path.origin = walk.ray.origin;
        }
    }

    fn vertex(&mut self) -> Option<&mut Vertex> {
        self.path.vertices.last_mut()
    }

    fn nearest(&self, ray: &Ray) -> Option<u32> {
        Some(self.view.closest(ray)).filter(Hit::is_hit).map(|hit| hit.id)
    }

    /// The triangle that a point was drawn on: the nearest to the point, seen from just above it.
    fn triangle_below(&self, light: &LightSample) -> Option<u32> {
        let origin = light.position + light.normal * light.offset;
        let ray = Ray { origin, direction: -light.normal, t_max: 2.0 * light.offset, key: 0 };
        // as if it were everywhere, so that no chance decides
        let solid = SceneView { features: self.view.features & !FEATURE_ALPHA, ..*self.view };
        let below = (light.kind == LightKind::Area).then(|| solid.closest(&ray));
        below.filter(Hit::is_hit).map(|hit| hit.id)
    }
}

impl Receiver for Writer<'_> {
    fn add(&mut self, _: Vec3) {}

    fn arrive(&mut self, walk: &Walk, hit: &Hit, point: &SurfacePoint) {
        self.begin(walk);
        let (material, instance) = owner(self.view, hit.id);
        self.path.vertices.push(Vertex {
            triangle: hit.id,
            material,
            instance,
            direction: walk.ray.direction,
            t: hit.t,
            position: point.position,
            normal: point.normal,
            scatter_pdf: if walk.depth > 0 && walk.chosen.alone { f32::INFINITY } else { walk.chosen.pdf },
            throughput: walk.throughput,
            emission: None,
            light: None,
        });
    }

    fn emission(&mut self, radiance: Vec3, weight: f32, contribution: Vec3) {
        if let Some(vertex) = self.vertex() {
            vertex.emission = Some(Emission { radiance, weight, contribution });
        }
    }

    /// A light that cannot add anything is asked no ray; of others the path says by [`Self::next_event`] that they are visible.
    fn light(&mut self, light: &LightSample, connection: &Connection) {
        let triangle = self.triangle_below(light);
        let asked = connection.value.max_element() > 0.0;
        let next_event = NextEvent {
            triangle,
            material: triangle.map(|triangle| owner(self.view, triangle).0),
            kind: light.kind,
            position: light.position,
            density: light.density,
            visible: asked.then_some(false),
            blocker: if asked { self.nearest(&connection.shadow) } else { None },
            contribution: Vec3::ZERO,
        };
        if let Some(vertex) = self.vertex() {
            vertex.light = Some(next_event);
        }
    }

    fn next_event(&mut self, _: Vec3, contribution: Vec3) {
        if let Some(light) = self.vertex().and_then(|vertex| vertex.light.as_mut()) {
            *light = NextEvent { visible: Some(true), contribution, ..*light };
        }
    }

    fn escape(&mut self, walk: &Walk) {
        self.begin(walk);
        let direction = walk.ray.direction;
        self.path.escape = Some(Escape { direction, radiance: Vec3::ZERO, contribution: Vec3::ZERO });
    }

    fn environment(&mut self, environment: &EnvironmentPoint, _: f32, contribution: Vec3) {
        if let Some(escape) = &mut self.path.escape {
            *escape = Escape { radiance: environment.radiance, contribution, ..*escape };
        }
    }
}
