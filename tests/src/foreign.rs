//! A scene of an embedder: spheres, in no arena, which implements the traits that path tracing asks for.

use glam::{UVec4, Vec2, Vec3};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::num::{PI, div, sqrt};
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

impl HollowSphere {
    fn density(&self) -> f32 {
        div(1.0, 4.0 * PI * self.radius * self.radius)
    }
}

impl Trace for HollowSphere {
    /// The far intersection, for rays from inside; the hit's `uv` is not used.
    fn closest(&self, ray: &Ray) -> Hit {
        let a = dot(ray.direction, ray.direction);
        let b = dot(ray.origin, ray.direction);
        let c = dot(ray.origin, ray.origin) - self.radius * self.radius;
        let t = div(sqrt(b * b - a * c) - b, a);
        if t > 0.0 && t < ray.t_max { Hit { t, id: 0, uv: Vec2::ZERO } } else { Hit::MISS }
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.closest(ray).is_hit()
    }
}

impl Surface for HollowSphere {
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let position = ray.origin + ray.direction * hit.t;
        let reflectance = Vec3::splat(self.reflectance);
        SurfacePoint {
            emission: Vec3::splat(self.emission),
            ..SurfacePoint::diffuse(position, -normalize(position), self.radius * OFFSET, reflectance)
        }
    }
}

impl Lights for HollowSphere {
    fn sample_light(&self, words: UVec4) -> LightSample {
        let z = 2.0 * unit(words.x) - 1.0;
        let (sin, cos) = restir_shared::num::sin_cos(unit(words.y));
        let ring = sqrt(1.0 - z * z);
        let outward = Vec3::new(ring * cos, ring * sin, z);
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
