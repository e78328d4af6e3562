//! What a pixel sees.

use super::{DiParams, Flags, MAX_GLOSS_RENEWAL};
use crate::bsdf::Gloss;
use crate::camera::camera_ray;
use crate::geometry::{Hit, PackedHit, Ray};
use crate::layout::CameraParams;
use crate::num;
use crate::resample::params::ReuseParams;
use crate::rng::{Rng, Sampler};
use crate::scene::{BsdfOf, Surface, SurfacePoint, Trace};
use crate::transport::Vertex;
use crate::vec::normalize;
use glam::Vec3;

/// The hit of the camera's ray through the pixel `at`.
pub fn primary<S: Trace + Surface>(scene: &S, params: &DiParams, at: [u32; 2]) -> PackedHit {
    PackedHit::pack(&scene.closest(&primary_ray(params, scene.features(), at)))
}

/// The camera's ray through the pixel `at`, in a scene of these features: what [`primary`] traces.
pub fn primary_ray(params: &DiParams, features: u32, at: [u32; 2]) -> Ray {
    params.view().ray(at, features)
}

/// The camera of a frame.
#[derive(Clone, Copy)]
pub(super) struct View {
    pub(super) camera: CameraParams,
    jitter: bool,
    frame: u32,
    seed: u32,
    sampler: Sampler,
}

impl DiParams {
    #[inline(always)]
    pub(super) fn view(&self) -> View {
        let ReuseParams { camera, frame, seed, flags, .. } = self.reuse;
        View { camera, jitter: flags.contains(Flags::JITTER), frame, seed, sampler: flags.sampler() }
    }

    /// The view of the other reservoirs' frame.
    #[inline(always)]
    pub(super) fn other_view(&self) -> View {
        View { camera: self.other_camera, frame: self.other_frame, ..self.view() }
    }
}

impl View {
    #[inline(always)]
    pub(super) fn ray(&self, [x, y]: [u32; 2], features: u32) -> Ray {
        let rng = Rng::new(x, y, self.frame, self.seed, self.sampler);
        camera_ray(&self.camera, self.jitter, |u| u, features, &rng, x, y)
    }

    #[inline(always)]
    pub(super) fn pixel(&self, at: [u32; 2], hit: PackedHit) -> Pixel {
        self.of_hit(at, hit.unpack())
    }

    #[inline(always)]
    pub(super) fn of_hit(&self, at: [u32; 2], hit: Hit) -> Pixel {
        // its hit is known: nothing is decided by its key
        Pixel { ray: self.ray(at, 0), hit }
    }
}

/// A pixel of a frame: its camera ray and what it hits.
#[derive(Clone, Copy)]
pub(super) struct Pixel {
    pub(super) ray: Ray,
    pub(super) hit: Hit,
}

impl Pixel {
    #[inline(always)]
    pub(super) fn point<S: Surface>(&self, scene: &S) -> SurfacePoint<S::Material> {
        scene.surface(&self.ray, &self.hit)
    }

    /// How many rounds of candidates there are: the more, the more of the confidence of history fades. Confidences make up for it, and as they follow from
    /// surfaces and cameras alone, reuse stays unbiased.
    #[inline(always)]
    pub(super) fn rounds(&self, params: &DiParams, gloss: Gloss) -> u32 {
        let faded = 1.0 - self.kept(params.gloss_fade, gloss, &params.other_view());
        1 + num::clamp(params.gloss_renewal * faded, 0.0, MAX_GLOSS_RENEWAL as f32) as u32
    }

    /// What is left of the confidence of reservoirs of another view, which saw the surface from elsewhere ([`Gloss::kept`]).
    #[inline(always)]
    pub(super) fn kept(&self, rate: f32, gloss: Gloss, then: &View) -> f32 {
        let Ray { origin, direction, .. } = self.ray;
        let position = origin + direction * self.hit.t;
        gloss.kept(rate, -direction, normalize(Vec3::from_array(then.camera.position) - position))
    }

    #[inline(always)]
    pub(super) fn vertex<S: Surface>(&self, scene: &S) -> Vertex<BsdfOf<S>> {
        Vertex::new(&self.point(scene), &self.ray, scene.features())
    }
}
