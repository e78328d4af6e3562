//! Scenes that answer a technique's questions wrongly, each in one way: what the tests must be able to notice.

use glam::{UVec4, Vec3};
use restir_shared::bsdf::Material;
use restir_shared::geometry::{Crossings, Hit, Ray};
use restir_shared::medium::Interior;
use restir_shared::scene::{
    AddressedLight, AddressedLights, EnvironmentPoint, LightAddress, LightSample, Lights, Probe, Surface, SurfacePoint,
    Trace,
};

/// A way of being wrong: what becomes of the right answers.
#[derive(Clone, Copy, Debug)]
pub struct Fault {
    /// Changes a ray before it is traced.
    pub ray: fn(&mut Ray),
    /// Changes a point; the function gives the same point seen from the other side.
    pub surface: fn(&mut SurfacePoint, &dyn Fn() -> SurfacePoint),
    /// Changes a point on an emitter.
    pub light: fn(&mut LightSample),
    /// Changes the density of a hit emitter.
    pub density: fn(f32) -> f32,
    /// Changes whether a segment is blocked.
    pub occluded: fn(bool) -> bool,
}

impl Fault {
    /// Nothing is wrong.
    pub const NONE: Self = Self {
        ray: |_| (),
        surface: |_, _| (),
        light: |_| (),
        density: |density| density,
        occluded: |occluded| occluded,
    };
    /// The light's density is off by a factor, in sampling and in the weights.
    pub const DENSITY: Self =
        Self { light: |light| light.density *= 1.02, density: |density| density * 1.02, ..Self::NONE };
}

/// A scene with a fault.
pub struct Faulty<S> {
    /// The right scene.
    pub scene: S,
    /// The fault.
    pub fault: Fault,
}

impl<S: Trace> Trace for Faulty<S> {
    fn closest(&self, ray: &Ray) -> Hit {
        self.scene.closest(&self.changed(ray))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        (self.fault.occluded)(self.scene.occluded(&self.changed(ray)))
    }
}

impl<S: Probe> Probe for Faulty<S> {
    fn object(&self, hit: &Hit) -> u32 {
        self.scene.object(hit)
    }

    fn probe(&self, ray: &Ray, object: u32) -> Crossings {
        self.scene.probe(&self.changed(ray), object)
    }
}

impl<S> Faulty<S> {
    fn changed(&self, ray: &Ray) -> Ray {
        let mut ray = *ray;
        (self.fault.ray)(&mut ray);
        ray
    }
}

impl<S: Surface<Material = Material>> Surface for Faulty<S> {
    type Material = Material;

    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let mut point = self.scene.surface(ray, hit);
        let back = Ray { direction: -ray.direction, ..*ray };
        (self.fault.surface)(&mut point, &|| self.scene.surface(&back, hit));
        point
    }

    fn interior(&self, hit: &Hit) -> Interior {
        self.scene.interior(hit)
    }

    fn absorbed(&self, hit: &Hit) -> Vec3 {
        self.scene.absorbed(hit)
    }
}

impl<S: Lights> Lights for Faulty<S> {
    fn sample_light(&self, words: UVec4) -> LightSample {
        let mut light = self.scene.sample_light(words);
        (self.fault.light)(&mut light);
        light
    }

    fn light_density(&self, hit: &Hit) -> f32 {
        (self.fault.density)(self.scene.light_density(hit))
    }

    fn environment(&self, direction: Vec3) -> EnvironmentPoint {
        self.scene.environment(direction)
    }
}

impl<S: AddressedLights> AddressedLights for Faulty<S> {
    fn choose_address(&self, words: UVec4) -> LightAddress {
        self.scene.choose_address(words)
    }

    fn light_at(&self, address: LightAddress) -> AddressedLight {
        let mut light = self.scene.light_at(address);
        (self.fault.light)(&mut light.sample);
        light
    }

    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        self.scene.address_of_hit(hit)
    }

    fn address_of_environment(&self, direction: Vec3) -> LightAddress {
        self.scene.address_of_environment(direction)
    }
}

/// A scene put together of the answers of several.
pub struct Mixed<S> {
    /// What rays hit, and what is there.
    pub seen: S,
    /// What blocks segments.
    pub blocking: S,
    /// What lights there are.
    pub shining: S,
}

impl<S: Trace> Trace for Mixed<S> {
    fn closest(&self, ray: &Ray) -> Hit {
        self.seen.closest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.blocking.occluded(ray)
    }
}

impl<S: Probe> Probe for Mixed<S> {
    fn object(&self, hit: &Hit) -> u32 {
        self.seen.object(hit)
    }

    fn probe(&self, ray: &Ray, object: u32) -> Crossings {
        self.seen.probe(ray, object)
    }
}

impl<S: Surface<Material = Material>> Surface for Mixed<S> {
    type Material = Material;

    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.seen.surface(ray, hit)
    }

    fn interior(&self, hit: &Hit) -> Interior {
        self.seen.interior(hit)
    }

    fn absorbed(&self, hit: &Hit) -> Vec3 {
        self.seen.absorbed(hit)
    }

    fn features(&self) -> u32 {
        self.seen.features()
    }
}

impl<S: Lights> Lights for Mixed<S> {
    fn sample_light(&self, words: UVec4) -> LightSample {
        self.shining.sample_light(words)
    }

    fn light_density(&self, hit: &Hit) -> f32 {
        self.shining.light_density(hit)
    }

    fn environment(&self, direction: Vec3) -> EnvironmentPoint {
        self.shining.environment(direction)
    }
}

impl<S: AddressedLights> AddressedLights for Mixed<S> {
    fn choose_address(&self, words: UVec4) -> LightAddress {
        self.shining.choose_address(words)
    }

    fn light_at(&self, address: LightAddress) -> AddressedLight {
        self.shining.light_at(address)
    }

    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        self.shining.address_of_hit(hit)
    }

    fn address_of_environment(&self, direction: Vec3) -> LightAddress {
        self.shining.address_of_environment(direction)
    }
}
