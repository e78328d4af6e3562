//! A scene of an embedder: spheres, in no arena, which implements the traits that path tracing asks for.

use glam::{UVec4, Vec2, Vec3};
use restir_shared::bsdf::Material;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::num::{PI, atan2, div, max, sin_cos, sqrt};
use restir_shared::rng::unit;
use restir_shared::scene::{LightSample, Lights, Surface, SurfacePoint, Trace};
use restir_shared::vec::{dot, normalize};

/// How far spawned rays begin from a sphere, relative to its radius.
const OFFSET: f32 = 1.0e-4;

/// A sphere whose front is its inside.
#[derive(Clone, Copy, Debug)]
pub struct HollowSphere {
    /// Radius; the centre is the origin.
    pub radius: f32,
    /// Diffuse reflectance of the inside.
    pub reflectance: f32,
    /// Radiance emitted inwards.
    pub emission: f32,
}

/// A point of the unit sphere by height and longitude, in turns.
fn outward(uv: Vec2) -> Vec3 {
    let ring = sqrt(max(1.0 - uv.x * uv.x, 0.0));
    let (sin, cos) = sin_cos(uv.y);
    Vec3::new(ring * cos, ring * sin, uv.x)
}

impl HollowSphere {
    fn density(&self) -> f32 {
        div(1.0, 4.0 * PI * self.radius * self.radius)
    }
}

impl Trace for HollowSphere {
    /// The far intersection, for rays from inside; `uv` are height and longitude.
    fn closest(&self, ray: &Ray) -> Hit {
        let a = dot(ray.direction, ray.direction);
        let b = dot(ray.origin, ray.direction);
        let c = dot(ray.origin, ray.origin) - self.radius * self.radius;
        let t = div(sqrt(b * b - a * c) - b, a);
        let normal = normalize(ray.origin + ray.direction * t);
        let uv = Vec2::new(normal.z, atan2(normal.y, normal.x));
        if t > 0.0 && t < ray.t_max { Hit { t, id: 0, uv } } else { Hit::MISS }
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.closest(ray).is_hit()
    }
}

impl Surface for HollowSphere {
    type Material = Material;

    fn surface(&self, _: &Ray, hit: &Hit) -> SurfacePoint {
        let (outward, reflectance) = (outward(hit.uv), Vec3::splat(self.reflectance));
        SurfacePoint {
            emission: Vec3::splat(self.emission),
            ..SurfacePoint::diffuse(outward * self.radius, -outward, self.radius * OFFSET, reflectance)
        }
    }
}

impl Lights for HollowSphere {
    fn sample_light(&self, words: UVec4) -> LightSample {
        let outward = outward(Vec2::new(2.0 * unit(words.x) - 1.0, unit(words.y)));
        LightSample {
            position: outward * self.radius,
            normal: -outward,
            offset: self.radius * OFFSET,
            emission: Vec3::splat(self.emission),
            density: self.density(),
            ..LightSample::NONE
        }
    }

    fn light_density(&self, _: &Hit) -> f32 {
        self.density()
    }
}
