//! What a pixel sees.

use super::{DI_JITTER, DiParams};
use crate::camera::camera_ray;
use crate::geometry::{Hit, Ray};
use crate::layout::CameraParams;
use crate::rng::Rng;
use crate::scene::{Surface, SurfacePoint, Trace};
use crate::transport::Vertex;
use glam::{UVec4, Vec2};

/// The hit of the camera's ray through the pixel (x, y), packed.
pub fn primary<S: Trace>(scene: &S, params: &DiParams, flags: u32, [x, y]: [u32; 2]) -> UVec4 {
    let rng = Rng::new(x, y, params.frame, params.seed);
    pack_hit(&scene.closest(&camera_ray(&params.camera, flags & DI_JITTER != 0, &rng, x, y)))
}

/// A hit as it lies in a plane.
#[inline(always)]
pub fn pack_hit(hit: &Hit) -> UVec4 {
    UVec4::new(hit.t.to_bits(), hit.id, hit.uv.x.to_bits(), hit.uv.y.to_bits())
}

/// The inverse of [`pack_hit`].
#[inline(always)]
pub fn unpack_hit(word: UVec4) -> Hit {
    Hit { t: f32::from_bits(word.x), id: word.y, uv: Vec2::new(f32::from_bits(word.z), f32::from_bits(word.w)) }
}

/// A pixel of a frame: its camera ray and what it hits.
#[derive(Clone, Copy)]
pub(super) struct Pixel {
    pub(super) ray: Ray,
    pub(super) hit: Hit,
}

impl Pixel {
    #[inline(always)]
    pub(super) fn new(camera: &CameraParams, flags: u32, seed: u32, frame: u32, [x, y]: [u32; 2], hit: UVec4) -> Self {
        let rng = Rng::new(x, y, frame, seed);
        Self { ray: camera_ray(camera, flags & DI_JITTER != 0, &rng, x, y), hit: unpack_hit(hit) }
    }

    #[inline(always)]
    pub(super) fn point<S: Surface>(&self, scene: &S) -> SurfacePoint {
        scene.surface(&self.ray, &self.hit)
    }

    #[inline(always)]
    pub(super) fn vertex<S: Surface>(&self, scene: &S) -> Vertex {
        Vertex::new(&self.point(scene), &self.ray, scene.features())
    }
}
