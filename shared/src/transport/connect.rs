//! Connections of a vertex.

use super::vertex::Vertex;
use crate::geometry::Ray;
use crate::num;
use crate::scene::{LightKind, LightSample};
use crate::vec::{dot, flush};
use glam::Vec3;

/// Points closer than 2^-40 count as the same: no light passes between them.
const MIN_DISTANCE_SQUARED: f32 = 8.271_806e-25;

/// Light from a sampled point, if nothing lies on the segment.
#[derive(Clone, Copy)]
pub struct Connection {
    /// Emission times `f |cos|` of the vertex; black if nothing can arrive.
    pub value: Vec3,
    /// Density per steradian with which scattering finds the light.
    pub scatter_pdf: f32,
    /// Cosine at an emitting surface, 1 of other lights.
    pub cos_light: f32,
    /// 1 of lights at infinity.
    pub distance_squared: f32,
    /// The segment between the two.
    pub shadow: Ray,
}

impl Vertex {
    /// What arrives from a point on a light.
    #[inline(always)]
    pub fn connect(&self, light: &LightSample) -> Connection {
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
