//! A scene that stands still, for code that asks for two frames.

use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{UVec4, Vec3};
use restir_shared::scene::{
    AddressedLight, AddressedLights, EnvironmentPoint, Frames, LightAddress, LightSample, Lights, Surface,
    SurfacePoint, Trace,
};

/// A scene that was the same in any other frame.
pub struct Still<'a, S>(pub &'a S);

impl<'a, S: Trace + Surface + AddressedLights> Frames for Still<'a, S> {
    type Scene = Still<'a, S>;

    fn scene(&self, _other: bool) -> Self::Scene {
        Still(self.0)
    }

    fn counterpart(&self, address: LightAddress, _of_other: bool) -> LightAddress {
        address
    }
}

impl<S: Trace> Trace for Still<'_, S> {
    fn closest(&self, ray: &Ray) -> Hit {
        self.0.closest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.0.occluded(ray)
    }
}

impl<S: Surface> Surface for Still<'_, S> {
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.0.surface(ray, hit)
    }

    fn sheet(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.0.sheet(ray, hit)
    }

    fn features(&self) -> u32 {
        self.0.features()
    }
}

impl<S: Lights> Lights for Still<'_, S> {
    fn sample_light(&self, words: UVec4) -> LightSample {
        self.0.sample_light(words)
    }

    fn light_density(&self, hit: &Hit) -> f32 {
        self.0.light_density(hit)
    }

    fn environment(&self, direction: Vec3) -> EnvironmentPoint {
        self.0.environment(direction)
    }
}

impl<S: AddressedLights> AddressedLights for Still<'_, S> {
    fn choose_address(&self, words: UVec4) -> LightAddress {
        self.0.choose_address(words)
    }

    fn light_at(&self, address: LightAddress) -> AddressedLight {
        self.0.light_at(address)
    }

    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        self.0.address_of_hit(hit)
    }

    fn address_of_environment(&self, direction: Vec3) -> LightAddress {
        self.0.address_of_environment(direction)
    }
}
