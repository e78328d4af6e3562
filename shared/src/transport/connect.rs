//! Connections of a vertex: with a light, and with a point of another surface.

use super::vertex::Vertex;
use crate::bsdf::ScatteringFunction;
use crate::geometry::Ray;
use crate::num;
use crate::scene::{LightKind, LightSample, SurfacePoint};
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

/// The segment from a vertex to a point of a surface, and how light scatters along it: what joins a path again to the rest of
/// another one, by the reconnection shift (Lehtinen et al. 2013; Lin et al. 2022, §5).
#[derive(Clone, Copy)]
pub struct Reconnection {
    /// Unit direction from the vertex to the point.
    pub direction: Vec3,
    /// `f |cos|` of the vertex, of all lobes but deltas; black if nothing can pass.
    pub value: Vec3,
    /// Density per steradian with which scattering at the vertex finds the direction, over all lobes but deltas.
    pub pdf: f32,
    /// The part of one lobe in it, the probability of its selection included.
    pub lobe_pdf: f32,
    /// Solid angle at the vertex per area at the point, `|cos| / distance²`: densities times this are per area. The Jacobian of a
    /// reconnection is its value at the new vertex over that at the old one.
    pub per_area: f32,
    /// The segment between the two.
    pub shadow: Ray,
}

/// A segment on its way from a vertex to a point.
struct Reach {
    /// From where the segment begins to the point; of a point at infinity its direction.
    to: Vec3,
    /// The vertex lies on the front side of the point's surface.
    facing: bool,
    shadow: Ray,
}

impl<B: ScatteringFunction> Vertex<B> {
    /// The segment ends as far off the surface at the other end as it begins off this one.
    #[inline(always)]
    fn reach(&self, position: Vec3, normal: Vec3, offset: f32, far: bool, key: u32) -> Reach {
        let origin = self.origin(if far { position } else { position - self.position });
        let to = if far { position } else { position - origin };
        let facing = dot(normal, to) < 0.0;
        let side = if facing { offset } else { -offset };
        let target = if far { to } else { (position + normal * side) - origin };
        Reach { to, facing, shadow: Ray { origin, direction: target, t_max: if far { Ray::FAR } else { 1.0 }, key } }
    }

    /// Reconnects to a point of a surface, with the densities of all lobes together and of `lobe` alone.
    #[inline(always)]
    pub fn reconnect<M>(&self, point: &SurfacePoint<M>, lobe: u32) -> Reconnection {
        let Reach { to, shadow, .. } = self.reach(point.position, point.normal, point.offset, false, 0);
        let distance_squared = dot(to, to);
        let nothing = Reconnection { direction: to, value: Vec3::ZERO, pdf: 0.0, lobe_pdf: 0.0, per_area: 0.0, shadow };
        if distance_squared <= MIN_DISTANCE_SQUARED {
            return nothing;
        }
        let direction = to * num::rsqrt(distance_squared);
        let local = self.frame.to_local(direction);
        let (all, lobe) = self.bsdf.evaluate_with_lobe(lobe, local);
        let per_area = num::div(num::abs(dot(point.normal, direction)), distance_squared);
        if self.is_consistent(direction, local) {
            Reconnection { direction, value: all.value, pdf: all.pdf, lobe_pdf: lobe, per_area, shadow }
        } else {
            Reconnection { direction, ..nothing }
        }
    }

    /// What arrives from a point on a light.
    #[inline(always)]
    pub fn connect(&self, light: &LightSample) -> Connection {
        let far = light.at_infinity();
        let Reach { to: to_light, facing, shadow } =
            self.reach(light.position, light.normal, light.offset, far, light.key);
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
