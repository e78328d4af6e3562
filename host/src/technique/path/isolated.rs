//! A scene in which one source shines at one vertex of a path, and nothing else.

use std::cell::Cell;

use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{UVec4, Vec3};
use restir_shared::scene::{EnvironmentPoint, LightSample, Lights, Surface, SurfacePoint, Trace};

/// What shines. Vertices and light samples are counted from zero in the order of the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// The surface at a vertex, as it does.
    Emission(u32),
    /// The environment, where the path leaves the scene.
    Environment,
    /// The light sample drawn at a vertex.
    LightSample(u32),
    /// The surface at a vertex, with radiance 1, where light sampling has the given density instead of its own; with
    /// density zero the result is the path's throughput.
    Unit {
        /// The vertex.
        vertex: u32,
        /// Density of light sampling, per area.
        density: f32,
    },
}

/// Answers as the scene does, but for emission. It serves one path.
pub struct Isolated<'a, S> {
    scene: &'a S,
    source: Source,
    surfaces: Cell<u32>,
    light_samples: Cell<u32>,
}

impl<'a, S> Isolated<'a, S> {
    /// A scene in which only `source` shines.
    pub fn new(scene: &'a S, source: Source) -> Self {
        Self { scene, source, surfaces: Cell::new(0), light_samples: Cell::new(0) }
    }
}

/// The number of this call.
fn count(calls: &Cell<u32>) -> u32 {
    calls.replace(calls.get() + 1)
}

impl<S: Trace> Trace for Isolated<'_, S> {
    fn closest(&self, ray: &Ray) -> Hit {
        self.scene.closest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.scene.occluded(ray)
    }
}

impl<S: Surface> Surface for Isolated<'_, S> {
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let point = self.scene.surface(ray, hit);
        let here = count(&self.surfaces);
        let emission = match self.source {
            Source::Emission(vertex) if vertex == here => point.emission,
            Source::Unit { vertex, .. } if vertex == here => Vec3::ONE,
            _ => Vec3::ZERO,
        };
        SurfacePoint { emission, ..point }
    }

    fn features(&self) -> u32 {
        self.scene.features()
    }
}

impl<S: Lights> Lights for Isolated<'_, S> {
    fn sample_light(&self, words: UVec4) -> LightSample {
        let light = self.scene.sample_light(words);
        if self.source == Source::LightSample(count(&self.light_samples)) {
            light
        } else {
            LightSample { emission: Vec3::ZERO, ..light }
        }
    }

    fn light_density(&self, hit: &Hit) -> f32 {
        match self.source {
            Source::Unit { vertex, density } if vertex + 1 == self.surfaces.get() => density,
            _ => self.scene.light_density(hit),
        }
    }

    fn environment(&self, direction: Vec3) -> EnvironmentPoint {
        let point = self.scene.environment(direction);
        if self.source == Source::Environment { point } else { EnvironmentPoint { radiance: Vec3::ZERO, ..point } }
    }
}
