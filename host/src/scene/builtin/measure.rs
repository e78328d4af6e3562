//! What scenes promise about their light, measured by diffuse random walks from the camera.

use glam::{DVec3, UVec4, Vec2, Vec3};
use restir_shared::camera::primary_ray;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::scene::{Lights, Surface, SurfacePoint, Trace};

use super::random::Random;
use crate::buffers::SceneBuffers;
use crate::scene::Scene;

/// A scene to walk in: at each vertex the way goes on in a direction in proportion to the cosine.
pub(super) struct Walks {
    buffers: SceneBuffers,
    size: [u32; 2],
    random: Random,
}

/// A vertex of a walk, with its normals turned to where the walk came from.
pub(super) struct Vertex {
    point: SurfacePoint,
    pub(super) position: DVec3,
}

impl Walks {
    pub(super) fn new(scene: &Scene) -> Self {
        let buffers = SceneBuffers::build(scene).expect("builds");
        Self { buffers, size: scene.default_size.expect("built in"), random: Random::new(11) }
    }

    /// A ray through a uniform point of the image.
    pub(super) fn camera_ray(&mut self) -> Ray {
        let [width, height] = self.size;
        let pixel =
            Vec2::new((self.random.unit() * f64::from(width)) as f32, (self.random.unit() * f64::from(height)) as f32);
        primary_ray(&self.buffers.camera.params(width, height), pixel, Vec2::ZERO)
    }

    pub(super) fn trace(&self, ray: &Ray) -> Option<Vertex> {
        let hit: Hit = self.buffers.view().closest(ray);
        hit.is_hit().then(|| {
            let mut point = self.buffers.view().surface(ray, &hit);
            if point.normal.as_dvec3().dot(ray.direction.as_dvec3()) > 0.0 {
                point.normal = -point.normal;
            }
            Vertex { position: point.position.as_dvec3(), point }
        })
    }

    /// The way on from a vertex.
    pub(super) fn bounce(&mut self, vertex: &Vertex) -> Ray {
        let normal = vertex.point.normal.as_dvec3();
        let z = self.random.range(-1.0, 1.0);
        let (sin, cos) = self.random.range(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let direction = (normal + DVec3::new(r * cos, r * sin, z)).normalize_or(normal);
        Ray { origin: leave(&vertex.point), direction: direction.as_vec3(), t_max: Ray::FAR, key: 0 }
    }

    /// Whether a point on an emitter, chosen by power, shines on the vertex.
    pub(super) fn light_arrives(&mut self, vertex: &Vertex) -> bool {
        let word = |random: &mut Random| (random.unit() * 4_294_967_296.0) as u32;
        let words = UVec4::from_array([(); 4].map(|()| word(&mut self.random)));
        let light = self.buffers.view().sample_light(words);
        let origin = leave(&vertex.point);
        let target = light.position + light.normal * light.offset;
        let way = (target - origin).as_dvec3();
        let faces = way.dot(vertex.point.normal.as_dvec3()) > 0.0 && way.dot(light.normal.as_dvec3()) < 0.0;
        faces && !self.buffers.view().occluded(&Ray { origin, direction: target - origin, t_max: 1.0, key: 0 })
    }
}

fn leave(point: &SurfacePoint) -> Vec3 {
    point.position + point.normal * point.offset
}

/// The share of the next event estimates at vertices in `region` that are not zero, over walks of up to four vertices.
pub(super) fn light_share(scene: &Scene, walks: u32, region: impl Fn(DVec3) -> bool) -> f64 {
    let mut measured = Walks::new(scene);
    let (mut all, mut lit) = (0_u32, 0_u32);
    for _ in 0..walks {
        let mut ray = measured.camera_ray();
        for _ in 0..4 {
            let Some(vertex) = measured.trace(&ray) else { break };
            if region(vertex.position) {
                all += 1;
                lit += u32::from(measured.light_arrives(&vertex));
            }
            ray = measured.bounce(&vertex);
        }
    }
    f64::from(lit) / f64::from(all)
}
