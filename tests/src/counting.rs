//! A scene that counts what it is asked.

use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{UVec4, Vec3};
use restir_shared::scene::{
    AddressedLight, AddressedLights, EnvironmentPoint, LightAddress, LightSample, Lights, Surface, SurfacePoint, Trace,
};
use std::cell::Cell;

/// How often each question was asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Rays for their nearest hit.
    pub closest: u32,
    /// Shadow rays.
    pub shadow: u32,
    /// Lights at an address: each is an evaluation of a target.
    pub evaluations: u32,
}

/// Answers as the scene does, and counts.
pub struct Counting<'a, S> {
    scene: &'a S,
    counts: Cell<Counts>,
}

impl<'a, S> Counting<'a, S> {
    /// Nothing asked yet.
    pub fn new(scene: &'a S) -> Self {
        Self { scene, counts: Cell::default() }
    }

    /// What `work` asks.
    pub fn of<T>(&self, work: impl FnOnce() -> T) -> (T, Counts) {
        self.counts.take();
        let result = work();
        (result, self.counts.take())
    }

    fn count(&self, add: impl FnOnce(&mut Counts)) {
        let mut counts = self.counts.get();
        add(&mut counts);
        self.counts.set(counts);
    }
}

impl<S: Trace> Trace for Counting<'_, S> {
    fn closest(&self, ray: &Ray) -> Hit {
        self.count(|counts| counts.closest += 1);
        self.scene.closest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.count(|counts| counts.shadow += 1);
        self.scene.occluded(ray)
    }
}

impl<S: Surface> Surface for Counting<'_, S> {
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.scene.surface(ray, hit)
    }

    fn sheet(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.scene.sheet(ray, hit)
    }

    fn features(&self) -> u32 {
        self.scene.features()
    }
}

impl<S: Lights> Lights for Counting<'_, S> {
    fn sample_light(&self, words: UVec4) -> LightSample {
        self.scene.sample_light(words)
    }

    fn light_density(&self, hit: &Hit) -> f32 {
        self.scene.light_density(hit)
    }

    fn environment(&self, direction: Vec3) -> EnvironmentPoint {
        self.scene.environment(direction)
    }
}

impl<S: AddressedLights> AddressedLights for Counting<'_, S> {
    fn choose_address(&self, words: UVec4) -> LightAddress {
        self.scene.choose_address(words)
    }

    fn light_at(&self, address: LightAddress) -> AddressedLight {
        self.count(|counts| counts.evaluations += 1);
        self.scene.light_at(address)
    }

    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        self.scene.address_of_hit(hit)
    }

    fn address_of_environment(&self, direction: Vec3) -> LightAddress {
        self.scene.address_of_environment(direction)
    }
}
