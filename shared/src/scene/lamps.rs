use restir_shared::bsdf::Material;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{UVec4, Vec2, Vec3};
use restir_shared::layout::FEATURE_EMISSIVE;
use restir_shared::num::div;
use restir_shared::scene::{AddressedLight, AddressedLights, LightAddress, LightKind, LightSample, Lights};
use restir_shared::scene::{Surface, SurfacePoint, Trace};

/// An endless grey floor, the plane y = 0 and number 0, under two square lamps, numbers 1 and 2, that shine downwards.
#[derive(Clone, Copy, Debug)]
pub struct Lamps;

/// Height and half of the side of the lamps; where their centres are along x, their radiance, and how often each is chosen.
const HEIGHT: f32 = 2.0;
const HALF: f32 = 0.5;
const CENTRES: [f32; 2] = [-1.0, 1.0];
const RADIANCE: [f32; 2] = [3.0, 1.0];
const PROBABILITY: [f32; 2] = [0.75, 0.25];
const AREA: f32 = 4.0 * HALF * HALF;

impl Trace for Lamps {
    /// Of both sides: a lamp blocks the light of others from behind, too.
    fn closest(&self, ray: &Ray) -> Hit {
        let mut nearest = Hit { t: ray.t_max, ..Hit::MISS };
        for id in 0..3 {
            let plane = if id == 0 { 0.0 } else { HEIGHT };
            let t = div(plane - ray.origin.y, ray.direction.y);
            let at = ray.origin + ray.direction * t;
            let uv = Vec2::new(at.x, at.z);
            let within = |lamp: usize| (at.x - CENTRES[lamp]).abs() < HALF && at.z.abs() < HALF;
            if t > 0.0 && t < nearest.t && (id == 0 || within(id as usize - 1)) {
                nearest = Hit { t, id, uv };
            }
        }
        if nearest.t < ray.t_max { nearest } else { Hit::MISS }
    }
}
impl Surface for Lamps {
    type Material = Material;
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let Some(lamp) = (hit.id as usize).checked_sub(1) else {
            return SurfacePoint::diffuse(Vec3::new(hit.uv.x, 0.0, hit.uv.y), Vec3::Y, 1e-4, Vec3::splat(0.5));
        };
        let position = Vec3::new(hit.uv.x, HEIGHT, hit.uv.y);
        // what is seen from the front shines, as `light_at` says
        let emission = if ray.direction.y > 0.0 { Vec3::splat(RADIANCE[lamp]) } else { Vec3::ZERO };
        SurfacePoint { emission, ..SurfacePoint::diffuse(position, Vec3::NEG_Y, 1e-4, Vec3::ZERO) }
    }
    fn features(&self) -> u32 {
        FEATURE_EMISSIVE
    }
}
impl Lights for Lamps {
    fn sample_light(&self, words: UVec4) -> LightSample {
        self.light_at(self.choose_address(words)).sample
    }
    /// The density of what `sample_light` gives: rays hit the lamps, too, and both ways to find a point are weighed against each other.
    fn light_density(&self, hit: &Hit) -> f32 {
        (hit.id as usize).checked_sub(1).map_or(0.0, |lamp| PROBABILITY[lamp] / AREA)
    }
}
impl AddressedLights for Lamps {
    /// The first two words make the point, the third chooses the lamp.
    fn choose_address(&self, words: UVec4) -> LightAddress {
        LightAddress::of_words(u32::from(words.z >= 3 << 30), words)
    }
    fn light_at(&self, address: LightAddress) -> AddressedLight {
        let (lamp, uv) = (address.light as usize, (address.uv() * 2.0 - 1.0) * HALF);
        let position = Vec3::new(CENTRES[lamp] + uv.x, HEIGHT, uv.y);
        let emission = Vec3::splat(RADIANCE[lamp]);
        let density = PROBABILITY[lamp] / AREA;
        let kind = LightKind::Area;
        let sample =
            LightSample { position, normal: Vec3::NEG_Y, emission, density, kind, offset: 1e-4, ..LightSample::NONE };
        AddressedLight { sample, extent: AREA }
    }
    /// The way back from a point that a ray has hit: `light_at` of it is that point.
    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        (hit.id as usize).checked_sub(1).map_or(LightAddress::NONE, |lamp| {
            let from_centre = hit.uv - Vec2::new(CENTRES[lamp], 0.0);
            LightAddress::nearest(lamp as u32, from_centre / (2.0 * HALF) + 0.5)
        })
    }
}
