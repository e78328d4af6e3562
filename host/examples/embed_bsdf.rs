//! A renderer's own scattering model, Oren and Nayar's (1994, "Generalization of Lambert's Reflectance Model"), in the path tracer.
use restir_shared::bsdf::{BsdfSample, Evaluation, Scattering, ScatteringFunction};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{UVec4, Vec2, Vec3};
use restir_shared::sampling::{invert_cosine_hemisphere, sample_cosine_hemisphere};
use restir_shared::scene::{LightSample, Lights, Surface, SurfacePoint, Trace};
use restir_shared::vec::{dot, normalize};
use restir_shared::{num, rng, technique::path};

/// A rough diffuse surface: its reflectance, and the standard deviation of its facets' slope angles in radians.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OrenNayar {
    pub(crate) reflectance: Vec3,
    pub(crate) sigma: f32,
}

/// The same, seen from a direction.
pub(crate) struct Seen {
    model: OrenNayar,
    wo: Vec3,
}

impl Scattering for OrenNayar {
    type Bsdf = Seen;

    fn bsdf(&self, wo: Vec3, _front: bool, _features: u32) -> Seen {
        Seen { model: *self, wo }
    }
}

impl ScatteringFunction for Seen {
    /// The paper's qualitative model (equation 30): sin a tan b of the larger and the smaller of both angles, times the cosine of the
    /// angle between both planes of incidence.
    fn evaluate(&self, wi: Vec3) -> Evaluation {
        if wi.z <= 0.0 || self.wo.z <= 0.0 {
            return Evaluation { value: Vec3::ZERO, pdf: 0.0 };
        }
        let square = self.model.sigma * self.model.sigma;
        let a = 1.0 - 0.5 * num::div(square, square + 0.33);
        let b = 0.45 * num::div(square, square + 0.09);
        // of vectors in the plane of the surface, as long as the sines
        let along = num::max(self.wo.x * wi.x + self.wo.y * wi.y, 0.0);
        let shape = a + b * num::div(along, num::max(self.wo.z, wi.z));
        let pdf = wi.z * std::f32::consts::FRAC_1_PI;
        Evaluation { value: self.model.reflectance * (shape * pdf), pdf }
    }

    fn sample(&self, words: UVec4) -> BsdfSample {
        let direction = sample_cosine_hemisphere(Vec2::new(rng::unit(words.x), rng::unit(words.y)));
        let Evaluation { value, pdf } = self.evaluate(direction);
        let weight = if pdf > 0.0 { value * num::recip(pdf) } else { Vec3::ZERO };
        BsdfSample { direction, weight, pdf, lobe: 0, lobe_pdf: pdf, delta: false }
    }

    fn evaluate_with_lobe(&self, _lobe: u32, wi: Vec3) -> (Evaluation, f32) {
        let evaluation = self.evaluate(wi);
        (evaluation, evaluation.pdf)
    }

    fn invert(&self, _lobe: u32, wi: Vec3, gamma: UVec4) -> UVec4 {
        let word = |u: f32| ((num::clamp(u, 0.0, 1.0 - num::UNIT_ROUNDOFF) * 16_777_216.0) as u32) << 8;
        let u = invert_cosine_hemisphere(wi);
        UVec4::new(word(u.x), word(u.y), gamma.z, gamma.w)
    }

    fn roughness(&self, _lobe: u32) -> f32 {
        1.0
    }
}

/// The inside of a unit sphere, which emits everywhere. Coordinates of hits are height and longitude in turns.
pub(crate) struct Inside {
    pub(crate) material: OrenNayar,
    pub(crate) emission: Vec3,
}

fn on_sphere(uv: Vec2) -> Vec3 {
    let (ring, (sin, cos)) = (num::sqrt(num::max(1.0 - uv.x * uv.x, 0.0)), num::sin_cos(uv.y));
    Vec3::new(ring * cos, ring * sin, uv.x)
}

impl Trace for Inside {
    fn closest(&self, ray: &Ray) -> Hit {
        let (a, b) = (dot(ray.direction, ray.direction), dot(ray.origin, ray.direction));
        let t = num::div(num::sqrt(num::max(b * b - a * (dot(ray.origin, ray.origin) - 1.0), 0.0)) - b, a);
        let normal = normalize(ray.origin + ray.direction * t);
        let uv = Vec2::new(normal.z, num::atan2(normal.y, normal.x));
        if t > 1e-4 && t < ray.t_max { Hit { t, id: 0, uv } } else { Hit::MISS }
    }
}

impl Surface for Inside {
    type Material = OrenNayar;

    fn surface(&self, _: &Ray, hit: &Hit) -> SurfacePoint<OrenNayar> {
        let (position, normal) = (on_sphere(hit.uv), -on_sphere(hit.uv));
        let (material, emission) = (self.material, self.emission);
        SurfacePoint {
            position,
            normal,
            shading_normal: normal,
            offset: 1e-4,
            material,
            emission,
            absorption: Vec3::ZERO,
        }
    }
}

impl Lights for Inside {
    fn sample_light(&self, words: UVec4) -> LightSample {
        let position = on_sphere(Vec2::new(1.0 - 2.0 * rng::unit(words.x), rng::unit(words.y)));
        let (normal, emission, density) = (-position, self.emission, self.light_density(&Hit::MISS));
        LightSample { position, normal, offset: 1e-4, emission, density, ..LightSample::NONE }
    }

    fn light_density(&self, _: &Hit) -> f32 {
        num::recip(4.0 * num::PI)
    }
}

fn main() {
    let ray = Ray { origin: Vec3::new(0.0, 0.0, 0.6), direction: Vec3::X, t_max: Ray::FAR, key: 0 };
    for sigma in [0.0, 0.3, 0.8] {
        let scene = Inside { material: OrenNayar { reflectance: Vec3::splat(0.8), sigma }, emission: Vec3::ONE };
        let sample = |i| path::radiance(&scene, ray, &rng::Rng::new(0, 0, i, 7, rng::Sampler::Sobol), 3, false).x;
        println!("sigma {sigma}: radiance {:.4} over two bounces", (0..4096).map(sample).sum::<f32>() / 4096.0);
    }
}
