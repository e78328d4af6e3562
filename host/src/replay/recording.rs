//! A scene that writes down what it was asked.

use std::cell::RefCell;

use restir_shared::bsdf::Material;
use restir_shared::geometry::{Crossings, Hit, Ray};
use restir_shared::glam::{UVec4, Vec3};
use restir_shared::medium::Interior;
use restir_shared::scene::{
    AddressedLight, AddressedLights, EnvironmentPoint, LightAddress, LightSample, Lights, Probe, Surface, SurfacePoint,
    Trace,
};

/// A question and its answer.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Event {
    /// The nearest hit of a ray.
    Closest {
        /// The ray.
        ray: Ray,
        /// What it hit.
        hit: Hit,
    },
    /// What is at the last hit.
    Surface(SurfacePoint),
    /// The density of light sampling at the last hit.
    LightDensity(f32),
    /// A point on an emitter.
    LightSample(LightSample),
    /// What arrives along the last ray, which hit nothing.
    Environment(EnvironmentPoint),
    /// Whether a segment is blocked.
    Occluded {
        /// The segment.
        ray: Ray,
        /// The answer.
        occluded: bool,
    },
    /// All hits of an object on a segment.
    Probed {
        /// The segment.
        ray: Ray,
        /// The object.
        object: u32,
        /// The answer.
        crossings: Crossings,
    },
}

/// How often each question was asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Rays for their nearest hit.
    pub closest: u64,
    /// Shadow rays.
    pub shadow: u64,
    /// Segments for all hits of an object.
    pub probes: u64,
    /// Evaluations of a surface.
    pub surfaces: u64,
    /// Points on emitters: drawn, or evaluated by their address.
    pub light_samples: u64,
}

impl Counts {
    /// Rays of all kinds.
    pub fn rays(&self) -> u64 {
        self.closest + self.shadow + self.probes
    }

    /// The counts of both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        self.zip(other, u64::saturating_add)
    }

    /// What these counts have beyond others.
    #[must_use]
    pub(crate) fn minus(self, other: Self) -> Self {
        self.zip(other, u64::saturating_sub)
    }

    fn zip(self, other: Self, join: fn(u64, u64) -> u64) -> Self {
        Self {
            closest: join(self.closest, other.closest),
            shadow: join(self.shadow, other.shadow),
            probes: join(self.probes, other.probes),
            surfaces: join(self.surfaces, other.surfaces),
            light_samples: join(self.light_samples, other.light_samples),
        }
    }
}

/// Answers as the scene does, and keeps every question with its answer, in order.
#[derive(Debug)]
pub struct Recording<'a, S> {
    scene: &'a S,
    events: RefCell<Vec<Event>>,
}

impl<'a, S> Recording<'a, S> {
    /// A recording of what `scene` is asked.
    pub fn new(scene: &'a S) -> Self {
        Self { scene, events: RefCell::default() }
    }

    /// What was asked so far.
    pub fn into_events(self) -> Vec<Event> {
        self.events.into_inner()
    }

    /// How often each question was asked since the last time, or since the beginning; what was asked is forgotten.
    pub fn take_counts(&self) -> Counts {
        let counts = self.counts();
        self.events.borrow_mut().clear();
        counts
    }

    /// How often each question was asked so far.
    pub fn counts(&self) -> Counts {
        let mut counts = Counts::default();
        for event in self.events.borrow().iter() {
            match event {
                Event::Closest { .. } => counts.closest += 1,
                Event::Surface(_) => counts.surfaces += 1,
                Event::LightDensity(_) | Event::Environment(_) => {}
                Event::LightSample(_) => counts.light_samples += 1,
                Event::Occluded { .. } => counts.shadow += 1,
                Event::Probed { .. } => counts.probes += 1,
            }
        }
        counts
    }

    fn note<T>(&self, answer: T, event: impl FnOnce(&T) -> Event) -> T {
        self.events.borrow_mut().push(event(&answer));
        answer
    }
}

impl<S: Trace> Trace for Recording<'_, S> {
    fn closest(&self, ray: &Ray) -> Hit {
        self.note(self.scene.closest(ray), |&hit| Event::Closest { ray: *ray, hit })
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.note(self.scene.occluded(ray), |&occluded| Event::Occluded { ray: *ray, occluded })
    }
}

impl<S: Probe> Probe for Recording<'_, S> {
    fn object(&self, hit: &Hit) -> u32 {
        self.scene.object(hit)
    }

    fn probe(&self, ray: &Ray, object: u32) -> Crossings {
        self.note(self.scene.probe(ray, object), |&crossings| Event::Probed { ray: *ray, object, crossings })
    }
}

impl<S: Surface<Material = Material>> Surface for Recording<'_, S> {
    type Material = Material;

    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.note(self.scene.surface(ray, hit), |&point| Event::Surface(point))
    }

    fn sheet(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.note(self.scene.sheet(ray, hit), |&point| Event::Surface(point))
    }

    fn interior(&self, hit: &Hit) -> Interior {
        self.scene.interior(hit)
    }

    fn absorbed(&self, hit: &Hit) -> Vec3 {
        self.scene.absorbed(hit)
    }

    fn features(&self) -> u32 {
        self.scene.features()
    }
}

impl<S: Lights> Lights for Recording<'_, S> {
    fn sample_light(&self, words: UVec4) -> LightSample {
        self.note(self.scene.sample_light(words), |&light| Event::LightSample(light))
    }

    fn light_density(&self, hit: &Hit) -> f32 {
        self.note(self.scene.light_density(hit), |&density| Event::LightDensity(density))
    }

    fn environment(&self, direction: Vec3) -> EnvironmentPoint {
        self.note(self.scene.environment(direction), |&point| Event::Environment(point))
    }
}

impl<S: AddressedLights> AddressedLights for Recording<'_, S> {
    fn choose_address(&self, words: UVec4) -> LightAddress {
        self.scene.choose_address(words)
    }

    fn light_at(&self, address: LightAddress) -> AddressedLight {
        let light = self.scene.light_at(address);
        self.note(light.sample, |&sample| Event::LightSample(sample));
        light
    }

    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        self.scene.address_of_hit(hit)
    }

    fn address_of_environment(&self, direction: Vec3) -> LightAddress {
        self.scene.address_of_environment(direction)
    }
}
