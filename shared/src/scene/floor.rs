use restir_shared::bsdf::Material;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{UVec4, Vec2, Vec3};
use restir_shared::layout::FEATURE_PUNCTUAL;
use restir_shared::num::{PI, div};
use restir_shared::scene::{AddressedLight, AddressedLights, LightAddress, LightKind, LightSample, Lights};
use restir_shared::scene::{Surface, SurfacePoint, Trace};

/// An endless grey floor, the plane y = 0, under a lamp two units above the origin.
#[derive(Clone, Copy, Debug)]
pub struct Floor;

impl Trace for Floor {
    fn closest(&self, ray: &Ray) -> Hit {
        let t = div(-ray.origin.y, ray.direction.y);
        let at = ray.origin + ray.direction * t;
        if t > 0.0 && t < ray.t_max { Hit { t, id: 0, uv: Vec2::new(at.x, at.z) } } else { Hit::MISS }
    }
}
impl Surface for Floor {
    type Material = Material;
    /// The point follows from `id` and `uv` alone, because reuse asks for it again from other pixels.
    fn surface(&self, _: &Ray, hit: &Hit) -> SurfacePoint {
        SurfacePoint::diffuse(Vec3::new(hit.uv.x, 0.0, hit.uv.y), Vec3::Y, 1e-4, Vec3::splat(0.5))
    }
    fn features(&self) -> u32 {
        FEATURE_PUNCTUAL
    }
}
impl Lights for Floor {
    fn sample_light(&self, words: UVec4) -> LightSample {
        self.light_at(self.choose_address(words)).sample
    }
}
impl AddressedLights for Floor {
    fn choose_address(&self, words: UVec4) -> LightAddress {
        LightAddress::of_words(0, words)
    }
    fn light_at(&self, _: LightAddress) -> AddressedLight {
        // the intensity with which the floor below the lamp has a radiance of 1: 0.5 / PI times 8 PI / 2²
        let (position, emission) = (Vec3::Y * 2.0, Vec3::splat(8.0 * PI));
        let sample = LightSample { position, emission, density: 1.0, kind: LightKind::Point, ..LightSample::NONE };
        AddressedLight { sample, extent: 1.0 }
    }
}
