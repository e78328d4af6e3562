//! A vertex of a path, seen from the side that the path came from.

use crate::bsdf::{
    Bsdf, BsdfSample, Evaluation, SPECULAR_REFLECTION, SPECULAR_TRANSMISSION, Scattering, ScatteringFunction,
};
use crate::geometry::Ray;
use crate::layout::FEATURE_SHADING;
use crate::num;
use crate::scene::SurfacePoint;
use crate::vec::{Frame, dot, normalize};
use glam::{UVec4, Vec3};

/// Shading normals are bent towards the viewer until the cosine to it is this, or the geometric normal's if that is less.
const MIN_SHADING_COS: f32 = 0.01;

/// A vertex of a path.
#[derive(Debug)]
pub struct Vertex<B = Bsdf> {
    pub(super) position: Vec3,
    pub(super) offset: f32,
    /// Geometric normal on the side that the path came from.
    pub(super) normal: Vec3,
    /// Around the shading normal on that side.
    pub frame: Frame,
    /// Scattering there, for the direction that the path came from.
    pub bsdf: B,
}

/// How a path that scatters leaves a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Departure {
    /// What was drawn; its direction is in the frame of the vertex.
    pub sample: BsdfSample,
    /// The segment that begins.
    pub ray: Ray,
    /// Whether light can come that way.
    pub alive: bool,
    /// The roughness of the lobe by which it was drawn.
    pub roughness: f32,
    /// The cosine between its direction and the geometric normal, on either side.
    pub cos: f32,
}

impl<B: ScatteringFunction> Vertex<B> {
    /// Scatters by four random words, in a scene of these features.
    #[doc(hidden)]
    #[inline(always)]
    pub fn depart(&self, words: UVec4, features: u32) -> Departure {
        let sample = self.bsdf.sample(words);
        let direction = self.frame.to_world(sample.direction);
        let key = Ray::random_key(features, words.x);
        Departure {
            sample,
            ray: Ray { origin: self.origin(direction), direction, t_max: Ray::FAR, key },
            alive: (sample.pdf > 0.0) & self.is_consistent(direction, sample.direction),
            roughness: self.bsdf.roughness(sample.lobe),
            cos: self.cos(direction),
        }
    }

    /// The share of specular lobes in the density of a direction: none where that is zero.
    #[inline(always)]
    pub(crate) fn specular_share(&self, direction: Vec3) -> f32 {
        let wi = self.frame.to_local(direction);
        let lobe = if wi.z < 0.0 { SPECULAR_TRANSMISSION } else { SPECULAR_REFLECTION };
        let (Evaluation { pdf, .. }, of_lobe) = self.bsdf.evaluate_with_lobe(lobe, wi);
        if pdf > 0.0 { num::div(of_lobe, pdf) } else { 0.0 }
    }
}

impl<B> Vertex<B> {
    /// The end of `ray` at `point`.
    #[inline(always)]
    pub fn new<M: Scattering<Bsdf = B>>(point: &SurfacePoint<M>, ray: &Ray, features: u32) -> Self {
        let front = dot(point.normal, ray.direction) <= 0.0;
        let wo = -ray.direction;
        let normal = if front { point.normal } else { -point.normal };
        let shading = if features & FEATURE_SHADING != 0 {
            facing(if front { point.shading_normal } else { -point.shading_normal }, normal, wo)
        } else {
            normal
        };
        let frame = Frame::new(shading);
        Self {
            position: point.position,
            offset: point.offset,
            normal,
            frame,
            bsdf: point.material.bsdf(frame.to_local(wo), front, features),
        }
    }

    /// Whether a direction goes to the other side of the surface than the path came from.
    #[doc(hidden)]
    #[inline(always)]
    pub fn is_behind(&self, direction: Vec3) -> bool {
        dot(self.normal, direction) < 0.0
    }

    /// Where a ray in the given direction leaves from: on the side that it goes to.
    #[inline(always)]
    pub fn origin(&self, direction: Vec3) -> Vec3 {
        let offset = if self.is_behind(direction) { -self.offset } else { self.offset };
        self.position + self.normal * offset
    }

    /// The cosine between a unit direction and the geometric normal, on either side.
    #[inline(always)]
    pub fn cos(&self, direction: Vec3) -> f32 {
        num::abs(dot(self.normal, direction))
    }

    /// Whether a direction lies on the same side of the surface as of the shading frame. Others would leak through
    /// the surface; they carry nothing, whoever chooses them.
    #[inline(always)]
    pub(crate) fn is_consistent(&self, direction: Vec3, local: Vec3) -> bool {
        self.is_behind(direction) == (local.z < 0.0)
    }
}

/// A shading normal bent towards the viewer, if it turns away from it. The geometric normal itself stays as it is.
#[inline(always)]
fn facing(shading: Vec3, geometric: Vec3, wo: Vec3) -> Vec3 {
    let cos = dot(shading, wo);
    let least = num::min(MIN_SHADING_COS, dot(geometric, wo));
    if cos < least { normalize(shading + wo * (least - cos)) } else { shading }
}
