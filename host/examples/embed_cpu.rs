//! A renderer's own scene, two spheres over a plane without any BVH, lit and path traced by `restir-shared`.
use restir_shared::bsdf::Material;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{UVec4, Vec2, Vec3};
use restir_shared::scene::{LightSample, Lights, Surface, SurfacePoint, Trace};
use restir_shared::vec::{dot, normalize};
use restir_shared::{num, rng, technique::path};

const SPHERES: [(Vec3, f32); 2] = [(Vec3::new(0.0, 1.0, 0.0), 1.0), (Vec3::new(1.5, 3.5, 1.0), 0.5)];
const LAMP: u32 = 1;
const FLOOR: u32 = 2;

struct Spheres;

/// A point of the unit sphere by height and longitude, in turns: what finds points of spheres again, and samples them.
fn on_sphere(z: f32, longitude: f32) -> Vec3 {
    let (r, (sin, cos)) = (num::sqrt(num::max(1.0 - z * z, 0.0)), num::sin_cos(longitude));
    Vec3::new(r * cos, r * sin, z)
}

impl Trace for Spheres {
    fn closest(&self, ray: &Ray) -> Hit {
        let floor = num::div(-ray.origin.y, ray.direction.y);
        let mut best = Hit { t: if floor > 1e-4 { floor } else { Ray::FAR }, id: FLOOR, uv: Vec2::ZERO };
        for (id, (center, radius)) in (0..).zip(SPHERES) {
            let (o, a) = (ray.origin - center, dot(ray.direction, ray.direction));
            let b = dot(o, ray.direction);
            let d = b * b - a * (dot(o, o) - radius * radius);
            let near = num::div(-b - num::sqrt(num::max(d, 0.0)), a);
            let far = num::div(-b + num::sqrt(num::max(d, 0.0)), a);
            let t = if near > 1e-4 { near } else { far };
            if d > 0.0 && t > 1e-4 && t < best.t {
                best = Hit { t, id, uv: Vec2::ZERO };
            }
        }
        let end = ray.origin + ray.direction * best.t;
        best.uv = if best.id == FLOOR {
            Vec2::new(end.x, end.z)
        } else {
            let normal = normalize(end - SPHERES[best.id as usize].0);
            Vec2::new(normal.z, num::atan2(normal.y, normal.x))
        };
        if best.t < ray.t_max { best } else { Hit::MISS }
    }
    fn occluded(&self, ray: &Ray) -> bool {
        self.closest(ray).is_hit()
    }
}
impl Surface for Spheres {
    type Material = Material;

    /// The point is where `id` and `uv` say: techniques that reuse it ask for it again from elsewhere.
    fn surface(&self, _: &Ray, hit: &Hit) -> SurfacePoint {
        let (position, normal) = if hit.id == FLOOR {
            (Vec3::new(hit.uv.x, 0.0, hit.uv.y), Vec3::Y)
        } else {
            let ((center, radius), normal) = (SPHERES[hit.id as usize], on_sphere(hit.uv.x, hit.uv.y));
            (center + normal * radius, normal)
        };
        let emission = Vec3::splat(if hit.id == LAMP { 20.0 } else { 0.0 });
        SurfacePoint { emission, ..SurfacePoint::diffuse(position, normal, 1e-3, Vec3::splat(0.6)) }
    }
}
impl Lights for Spheres {
    fn sample_light(&self, words: UVec4) -> LightSample {
        let (center, radius) = SPHERES[LAMP as usize];
        let normal = on_sphere(1.0 - 2.0 * rng::unit(words.x), rng::unit(words.y));
        let emission = Vec3::splat(20.0);
        let density = num::recip(4.0 * num::PI * radius * radius);
        LightSample { position: center + normal * radius, normal, offset: 1e-3, emission, density, ..LightSample::NONE }
    }
    fn light_density(&self, hit: &Hit) -> f32 {
        if hit.id == LAMP { num::recip(4.0 * num::PI * SPHERES[1].1 * SPHERES[1].1) } else { 0.0 }
    }
}

fn main() {
    let direction = normalize(Vec3::new(0.1, -0.05, -1.0));
    let ray = Ray { origin: Vec3::new(0.0, 1.0, 6.0), direction, t_max: Ray::FAR, key: 0 };
    let sample = |i| path::radiance(&Spheres, ray, &rng::Rng::new(0, 0, i, 7, rng::Sampler::Sobol), 5, false).x;
    println!("radiance along the ray: {:.3}", (0..4096).map(sample).sum::<f32>() / 4096.0);
}
