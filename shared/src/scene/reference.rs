//! A reference to a scene is a scene.

use super::{
    AddressedLight, AddressedLights, EnvironmentPoint, LightAddress, LightSample, Lights, Location, Probe, Surface,
    SurfacePoint, Trace,
};
use crate::geometry::{Crossings, Hit, Ray};
use crate::medium::Interior;
use glam::{UVec4, Vec3};

impl<S: Trace + ?Sized> Trace for &S {
    #[inline(always)]
    fn closest(&self, ray: &Ray) -> Hit {
        (**self).closest(ray)
    }

    #[inline(always)]
    fn occluded(&self, ray: &Ray) -> bool {
        (**self).occluded(ray)
    }
}

impl<S: Probe + ?Sized> Probe for &S {
    #[inline(always)]
    fn object(&self, hit: &Hit) -> u32 {
        (**self).object(hit)
    }

    #[inline(always)]
    fn probe(&self, ray: &Ray, object: u32) -> Crossings {
        (**self).probe(ray, object)
    }
}

impl<S: Surface + ?Sized> Surface for &S {
    type Material = S::Material;

    #[inline(always)]
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint<S::Material> {
        (**self).surface(ray, hit)
    }

    #[inline(always)]
    fn location(&self, hit: &Hit) -> Location {
        (**self).location(hit)
    }

    #[inline(always)]
    fn off_edges(&self, hit: &Hit) -> Hit {
        (**self).off_edges(hit)
    }

    #[inline(always)]
    fn sheet(&self, ray: &Ray, hit: &Hit) -> SurfacePoint<S::Material> {
        (**self).sheet(ray, hit)
    }

    #[inline(always)]
    fn interior(&self, hit: &Hit) -> Interior {
        (**self).interior(hit)
    }

    #[inline(always)]
    fn absorbed(&self, hit: &Hit) -> Vec3 {
        (**self).absorbed(hit)
    }

    #[inline(always)]
    fn features(&self) -> u32 {
        (**self).features()
    }
}

impl<S: Lights + ?Sized> Lights for &S {
    #[inline(always)]
    fn sample_light(&self, words: UVec4) -> LightSample {
        (**self).sample_light(words)
    }

    #[inline(always)]
    fn light_density(&self, hit: &Hit) -> f32 {
        (**self).light_density(hit)
    }

    #[inline(always)]
    fn environment(&self, direction: Vec3) -> EnvironmentPoint {
        (**self).environment(direction)
    }
}

impl<S: AddressedLights + ?Sized> AddressedLights for &S {
    #[inline(always)]
    fn choose_address(&self, words: UVec4) -> LightAddress {
        (**self).choose_address(words)
    }

    #[inline(always)]
    fn light_at(&self, address: LightAddress) -> AddressedLight {
        (**self).light_at(address)
    }

    #[inline(always)]
    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        (**self).address_of_hit(hit)
    }

    #[inline(always)]
    fn address_of_environment(&self, direction: Vec3) -> LightAddress {
        (**self).address_of_environment(direction)
    }
}
