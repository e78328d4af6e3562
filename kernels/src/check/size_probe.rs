//! Measures what size costs: up to eight segments of a path in one kernel, each with a traversal, a surface and a GGX lobe
//! of its own, so that later kernels are cut with knowledge. `cargo lab probe` builds it and freezes how many there
//! are; it is never shipped.

use restir_shared::bsdf::Material;
use restir_shared::camera::primary_ray;
use restir_shared::geometry::Ray;
use restir_shared::glam::{Vec2, Vec3};
use restir_shared::layout::FilmPixel;
use restir_shared::num;
use restir_shared::rng::{self, Rng, Sampler};
use restir_shared::scene::{Surface, Trace};
use restir_shared::technique::path::PathParams;
use restir_shared::vec::{Frame, cross, dot, normalize};

kernel! {
    /// GGX-scattered segments, each traced at a call site of its own.
    pub fn size_probe(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: segments = 8 }
        params 0: PathParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        read {},
        own { 4: film: FilmPixel },
    }
    |x, y, at, p, scene| film[at] = FilmPixel::from_radiance(radiance(&scene, &p, segments, x, y))
}

fn radiance(
    scene: &(impl Trace + Surface<Material = Material>),
    params: &PathParams,
    segments: u32,
    x: u32,
    y: u32,
) -> Vec3 {
    let rng = Rng::new(x, y, params.first_sample, params.seed, Sampler::Independent);
    let ray = primary_ray(&params.camera, Vec2::new(x as f32 + 0.5, y as f32 + 0.5), Vec2::ZERO);
    let mut path = (Vec3::ZERO, Vec3::ONE, ray);
    // not a loop: that would have one call site
    macro_rules! segment {
        ($($index:literal)*) => {
            $(if segments > $index {
                path = segment(scene, &rng, $index, path);
            })*
        };
    }
    segment!(0 1 2 3 4 5 6 7);
    path.0 + path.1
}

/// The sum, the throughput and the ray after one more segment.
#[inline(always)]
fn segment(
    scene: &(impl Trace + Surface<Material = Material>),
    rng: &Rng,
    dimension: u32,
    (sum, weight, ray): (Vec3, Vec3, Ray),
) -> (Vec3, Vec3, Ray) {
    let hit = scene.closest(&ray);
    if !hit.is_hit() {
        return (sum, weight, ray);
    }
    let point = scene.surface(&ray, &hit);
    let words = rng.draw(dimension);
    let frame = Frame::new(if dot(point.normal, ray.direction) > 0.0 { -point.normal } else { point.normal });
    let view = frame.to_local(-ray.direction);
    let (local, value) = ggx(view, 0.09, Vec2::new(rng::unit(words.x), rng::unit(words.y)));
    let origin = point.position + frame.n * point.offset;
    let next = Ray { origin, direction: frame.to_world(local), t_max: Ray::FAR, key: 0 };
    (sum + weight * point.emission, weight * point.material.base_color * value, next)
}

/// Samples the visible normals of GGX (Heitz 2018, JCGT 7(4)): the reflected direction and its weight.
#[inline(always)]
fn ggx(view: Vec3, alpha: f32, u: Vec2) -> (Vec3, f32) {
    let stretched = normalize(Vec3::new(alpha * view.x, alpha * view.y, view.z));
    let side = stretched.x * stretched.x + stretched.y * stretched.y;
    let t1 = if side > 0.0 { Vec3::new(-stretched.y, stretched.x, 0.0) * num::rsqrt(side) } else { Vec3::X };
    let t2 = cross(stretched, t1);
    let r = num::sqrt(u.x);
    let (sin, cos) = num::sin_cos(u.y);
    let s = 0.5 * (1.0 + stretched.z);
    let p1 = r * cos;
    let p2 = (1.0 - s) * num::sqrt(num::max(1.0 - p1 * p1, 0.0)) + s * (r * sin);
    let p3 = num::sqrt(num::max(1.0 - p1 * p1 - p2 * p2, 0.0));
    let n = t1 * p1 + t2 * p2 + stretched * p3;
    let half = normalize(Vec3::new(alpha * n.x, alpha * n.y, num::max(n.z, 1.0e-6)));
    let light = half * (2.0 * dot(view, half)) - view;
    let a2 = alpha * alpha;
    let lambda = |z: f32| num::sqrt(1.0 + num::div(a2 * (1.0 - z * z), z * z + 1.0e-6));
    (light, num::div(1.0 + lambda(view.z), 1.0 + lambda(view.z) + lambda(light.z)))
}
