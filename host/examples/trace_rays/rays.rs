//! Sets of rays: what a path tracer asks of a scene, and chords, which nothing makes coherent.

use glam::{DVec3, UVec4, Vec2, Vec3};
use restir_host::buffers::SceneBuffers;
use restir_host::scene::Camera;
use restir_shared::camera::primary_ray;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::rng::{Rng, Sampler, unit};
use restir_shared::sampling::sample_cosine_hemisphere;
use restir_shared::scene::{LightKind, Lights, SceneView, Surface, SurfacePoint, Trace};
use restir_shared::vec::{Frame, dot};
use std::f64::consts::TAU;

const SIDE: u32 = 1024;
/// Rays of each set.
pub(crate) const COUNT: u32 = SIDE * SIDE;

/// What is asked about rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Query {
    Closest,
    Occluded,
}

/// Rays of a kind.
pub(crate) struct Set {
    pub name: &'static str,
    pub query: Query,
    pub rays: Vec<Ray>,
}

/// All sets. The rays after the first hit start at hits of primary rays, and those after the second at hits of these.
pub(crate) fn sets(buffers: &SceneBuffers, camera: Option<&Camera>) -> Result<Vec<Set>, String> {
    let view = buffers.traced_view();
    let bounds = buffers.stats().bounds;
    let around = Sphere::around(bounds);
    let primary = primary(camera.unwrap_or(&Camera::framing(bounds, 1.0)));
    let first = Points::hit(&view, &primary)?;
    let bounce = first.leave(1, |point, words| Some(scatter(point, words)))?;
    let second = Points::hit(&view, &bounce)?;
    let light = |point: &SurfacePoint, words| light(&view, &around, point, words);
    let (shadow, bounce_shadow) = (first.leave(2, light)?, second.leave(3, light)?);
    let closest = |name, rays| Set { name, query: Query::Closest, rays };
    let occluded = |name, rays| Set { name, query: Query::Occluded, rays };
    Ok(vec![
        closest("chords", chords(&around)),
        closest("primary", primary),
        closest("bounce", bounce),
        occluded("shadow", shadow),
        occluded("bounce-shadow", bounce_shadow),
    ])
}

struct Sphere {
    centre: DVec3,
    radius: f64,
}

impl Sphere {
    fn around(bounds: [[f32; 3]; 2]) -> Self {
        let [lo, hi] = bounds.map(|corner| Vec3::from_array(corner).as_dvec3());
        Self { centre: (lo + hi) * 0.5, radius: (hi - lo).length() * 0.5 }
    }

    /// A uniform point.
    fn point(&self, u: u32, v: u32) -> Vec3 {
        let (z, turn) = (2.0 * f64::from(unit(u)) - 1.0, f64::from(unit(v)));
        let ring = (1.0 - z * z).sqrt();
        (self.centre + self.radius * DVec3::new(ring * (TAU * turn).cos(), ring * (TAU * turn).sin(), z)).as_vec3()
    }
}

/// Segments between uniform points of a sphere, going on beyond it.
fn chords(sphere: &Sphere) -> Vec<Ray> {
    let chord = |i| {
        let words = Rng::new(i, 0, 0, 1, Sampler::Independent).draw(0);
        let (origin, end) = (sphere.point(words.x, words.y), sphere.point(words.z, words.w));
        Ray { origin, direction: end - origin, t_max: Ray::FAR, key: 0 }
    };
    (0..COUNT).map(chord).collect()
}

/// Rays through the pixels' centres of a square image.
fn primary(camera: &Camera) -> Vec<Ray> {
    let camera = Camera { lens_radius: 0.0, ..*camera }.params(SIDE, SIDE);
    let centre = |i: u32| Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5);
    (0..COUNT).map(|i| primary_ray(&camera, centre(i), Vec2::ZERO)).collect()
}

/// Where rays hit a scene, with normals to the side that they came from.
struct Points(Vec<SurfacePoint>);

impl Points {
    fn hit(view: &SceneView<'_>, rays: &[Ray]) -> Result<Self, String> {
        let hits = rays.iter().map(|ray| (ray, view.closest(ray)));
        let points: Vec<_> = hits.filter(|(_, hit)| hit.is_hit()).map(|(ray, hit)| point(view, ray, &hit)).collect();
        if points.is_empty() { Err("no ray hits the scene".into()) } else { Ok(Self(points)) }
    }

    /// Rays from the points in turns, as often as it takes; `target` gives a way from a point, or none.
    fn leave(&self, seed: u32, target: impl Fn(&SurfacePoint, UVec4) -> Option<Ray>) -> Result<Vec<Ray>, String> {
        let ray =
            |i: u32| target(&self.0[i as usize % self.0.len()], Rng::new(i, 0, 0, seed, Sampler::Independent).draw(0));
        let rays: Vec<Ray> = (0..32 * COUNT).filter_map(ray).take(COUNT as usize).collect();
        if rays.len() == COUNT as usize { Ok(rays) } else { Err(format!("only {} rays leave the hits", rays.len())) }
    }
}

fn point(view: &SceneView<'_>, ray: &Ray, hit: &Hit) -> SurfacePoint {
    let point = view.surface(ray, hit);
    let normal = if dot(point.normal, ray.direction) <= 0.0 { point.normal } else { -point.normal };
    SurfacePoint { normal, ..point }
}

/// As far off the surface as paths begin.
fn origin(point: &SurfacePoint) -> Vec3 {
    point.position + point.normal * point.offset
}

/// A ray whose density is proportional to the cosine.
fn scatter(point: &SurfacePoint, words: UVec4) -> Ray {
    let local = sample_cosine_hemisphere(Vec2::new(unit(words.x), unit(words.y)));
    let direction = Frame::new(point.normal).to_world(local);
    Ray { origin: origin(point), direction, t_max: Ray::FAR, key: 0 }
}

/// The segment to a point of a light, of a scene without lights to one of the sphere around it; none if that lies behind the
/// surface, to which no path tracer connects.
fn light(view: &SceneView<'_>, around: &Sphere, point: &SurfacePoint, words: UVec4) -> Option<Ray> {
    let origin = origin(point);
    let light = view.sample_light(words);
    let (direction, t_max) = match light.kind {
        _ if light.density == 0.0 => (around.point(words.x, words.y) - origin, 1.0),
        LightKind::Area => {
            (light.position + facing(light.normal, origin - light.position) * light.offset - origin, 1.0)
        }
        _ if light.at_infinity() => (light.position, Ray::FAR),
        _ => (light.position - origin, 1.0),
    };
    (dot(point.normal, direction) > 0.0).then_some(Ray { origin, direction, t_max, key: 0 })
}

fn facing(normal: Vec3, towards: Vec3) -> Vec3 {
    if dot(normal, towards) < 0.0 { -normal } else { normal }
}
