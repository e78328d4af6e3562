//! Scenes that answer a technique's questions wrongly, each in one way: what the tests must be able to notice.

use glam::{UVec4, Vec3};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::scene::{
    AddressedLight, AddressedLights, EnvironmentPoint, LightAddress, LightSample, Lights, Surface, SurfacePoint, Trace,
};

/// A way of being wrong.
pub trait Fault: Sync {
    /// Changes a point; `reversed` is the same point seen from the other side.
    fn surface(&self, _point: &mut SurfacePoint, _reversed: impl Fn() -> SurfacePoint) {}
    /// Changes a point on an emitter.
    fn light(&self, _light: &mut LightSample) {}
    /// Changes the density of a hit emitter.
    fn density(&self, density: f32) -> f32 {
        density
    }
    /// Changes whether a segment is blocked.
    fn occluded(&self, occluded: bool) -> bool {
        occluded
    }
}

/// A scene with a fault.
pub struct Faulty<S, F> {
    /// The right scene.
    pub scene: S,
    /// The fault.
    pub fault: F,
}

impl<S: Trace, F: Fault> Trace for Faulty<S, F> {
    fn closest(&self, ray: &Ray) -> Hit {
        self.scene.closest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.fault.occluded(self.scene.occluded(ray))
    }
}

impl<S: Surface, F: Fault> Surface for Faulty<S, F> {
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let mut point = self.scene.surface(ray, hit);
        let back = Ray { direction: -ray.direction, ..*ray };
        self.fault.surface(&mut point, || self.scene.surface(&back, hit));
        point
    }
}

impl<S: Lights, F: Fault> Lights for Faulty<S, F> {
    fn sample_light(&self, words: UVec4) -> LightSample {
        let mut light = self.scene.sample_light(words);
        self.fault.light(&mut light);
        light
    }

    fn light_density(&self, hit: &Hit) -> f32 {
        self.fault.density(self.scene.light_density(hit))
    }

    fn environment(&self, direction: Vec3) -> EnvironmentPoint {
        self.scene.environment(direction)
    }
}

impl<S: AddressedLights, F: Fault> AddressedLights for Faulty<S, F> {
    fn choose_address(&self, words: UVec4) -> LightAddress {
        self.scene.choose_address(words)
    }

    fn light_at(&self, address: LightAddress) -> AddressedLight {
        let mut light = self.scene.light_at(address);
        self.fault.light(&mut light.sample);
        light
    }

    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        self.scene.address_of_hit(hit)
    }

    fn address_of_environment(&self, direction: Vec3) -> LightAddress {
        self.scene.address_of_environment(direction)
    }
}

/// No fault.
pub struct Right;
impl Fault for Right {}

/// Throughput grows by a factor at every bounce.
pub struct Throughput(pub f32);
impl Fault for Throughput {
    fn surface(&self, point: &mut SurfacePoint, _: impl Fn() -> SurfacePoint) {
        point.material.base_color *= self.0;
    }
}

/// The light's density is off by a factor, in sampling and in the weights.
pub struct Density(pub f32);
impl Fault for Density {
    fn light(&self, light: &mut LightSample) {
        light.density *= self.0;
    }

    fn density(&self, density: f32) -> f32 {
        density * self.0
    }
}

/// The weights of hit emitters use another density than those of sampled ones.
pub struct HitDensity(pub f32);
impl Fault for HitDensity {
    fn density(&self, density: f32) -> f32 {
        density * self.0
    }
}

/// Emitters that are hit count in full, as if they were not sampled as well.
pub struct CountedTwice;
impl Fault for CountedTwice {
    fn density(&self, _: f32) -> f32 {
        0.0
    }
}

/// All emitters shine from both sides.
pub struct BothSides;
impl Fault for BothSides {
    fn surface(&self, point: &mut SurfacePoint, reversed: impl Fn() -> SurfacePoint) {
        point.emission = point.emission.max(reversed().emission);
    }

    fn light(&self, light: &mut LightSample) {
        light.two_sided = true;
    }
}

/// No shadows.
pub struct NoShadows;
impl Fault for NoShadows {
    fn occluded(&self, _: bool) -> bool {
        false
    }
}

/// Sampled emitters are brighter by 2 % in one channel.
pub struct Tinted;
impl Fault for Tinted {
    fn light(&self, light: &mut LightSample) {
        light.emission *= Vec3::new(1.02, 1.0, 1.0);
    }
}
