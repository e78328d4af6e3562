//! A vertex of a path, seen from the side that the path came from, and its connection to a light.

use crate::bsdf::Bsdf;
use crate::geometry::Ray;
use crate::layout::FEATURE_SHADING;
use crate::num;
use crate::scene::{LightKind, LightSample, SurfacePoint};
use crate::vec::{Frame, dot, normalize};
use glam::Vec3;

/// Shading normals are bent towards the viewer until the cosine to it is this, or the geometric normal's if that is less.
const MIN_SHADING_COS: f32 = 0.01;
/// Points closer than 2^-40 count as the same: no light passes between them.
const MIN_DISTANCE_SQUARED: f32 = 8.271_806e-25;

/// A vertex of a path.
pub(super) struct Vertex {
    position: Vec3,
    offset: f32,
    /// Geometric normal on the side that the path came from.
    normal: Vec3,
    /// Around the shading normal on that side.
    pub(super) frame: Frame,
    pub(super) bsdf: Bsdf,
}

/// Light from a sampled point, if nothing lies on the segment.
#[derive(Clone, Copy)]
pub(super) struct Connection {
    /// Emission times `f |cos|` of the vertex; black if nothing can arrive.
    pub(super) value: Vec3,
    /// Density per steradian with which scattering finds the light.
    pub(super) scatter_pdf: f32,
    /// Cosine at an emitting surface, 1 of other lights.
    pub(super) cos_light: f32,
    /// 1 of lights at infinity.
    pub(super) distance_squared: f32,
    pub(super) shadow: Ray,
}

impl Vertex {
    /// The end of `ray` at `point`.
    #[inline(always)]
    pub(super) fn new(point: &SurfacePoint, ray: &Ray, features: u32) -> Self {
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
            bsdf: Bsdf::new(&point.material, frame.to_local(wo), front, features),
        }
    }

    /// Where a ray in the given direction leaves from: on the side that it goes to.
    #[inline(always)]
    pub(super) fn origin(&self, direction: Vec3) -> Vec3 {
        let offset = if dot(self.normal, direction) < 0.0 { -self.offset } else { self.offset };
        self.position + self.normal * offset
    }

    /// Whether a direction lies on the same side of the surface as of the shading frame. Others would leak through
    /// the surface; they carry nothing, whoever chooses them.
    #[inline(always)]
    pub(super) fn is_consistent(&self, direction: Vec3, local: Vec3) -> bool {
        (dot(self.normal, direction) < 0.0) == (local.z < 0.0)
    }

    /// What arrives from a point on a light.
    #[inline(always)]
    pub(super) fn connect(&self, light: &LightSample) -> Connection {
        let far = light.at_infinity();
        let origin = self.origin(if far { light.position } else { light.position - self.position });
        let to_light = if far { light.position } else { light.position - origin };
        let facing = dot(light.normal, to_light) < 0.0;
        let side = if facing { light.offset } else { -light.offset };
        let target = if far { to_light } else { (light.position + light.normal * side) - origin };
        let shadow = Ray { origin, direction: target, t_max: if far { Ray::FAR } else { 1.0 } };
        let distance_squared = if far { 1.0 } else { dot(to_light, to_light) };
        let emits = (light.density > 0.0) & ((light.kind != LightKind::Area) | facing | light.two_sided);
        if !(emits & (distance_squared > MIN_DISTANCE_SQUARED)) {
            return Connection { value: Vec3::ZERO, scatter_pdf: 0.0, cos_light: 1.0, distance_squared: 1.0, shadow };
        }
        let inv_distance = if far { 1.0 } else { num::rsqrt(distance_squared) };
        let wi = to_light * inv_distance;
        let local = self.frame.to_local(wi);
        let axis_cos = -dot(light.normal, wi);
        let cos_light = if light.kind == LightKind::Area { num::abs(axis_cos) } else { 1.0 };
        let falloff = if light.kind == LightKind::Point { light.spot_falloff(axis_cos) } else { 1.0 };
        let scattered = self.bsdf.evaluate(local);
        let value = flush(light.emission * falloff * scattered.value);
        Connection {
            value: if self.is_consistent(wi, local) { value } else { Vec3::ZERO },
            scatter_pdf: if light.is_punctual() { 0.0 } else { scattered.pdf },
            cos_light,
            distance_squared,
            shadow,
        }
    }
}

/// Named point of flushing: magnitudes below 2^-100 are zero.
#[inline(always)]
pub(super) fn flush(v: Vec3) -> Vec3 {
    Vec3::new(num::flush(v.x), num::flush(v.y), num::flush(v.z))
}

/// A shading normal bent towards the viewer, if it turns away from it. The geometric normal itself stays as it is.
#[inline(always)]
fn facing(shading: Vec3, geometric: Vec3, wo: Vec3) -> Vec3 {
    let cos = dot(shading, wo);
    let least = num::min(MIN_SHADING_COS, dot(geometric, wo));
    if cos < least { normalize(shading + wo * (least - cos)) } else { shading }
}
