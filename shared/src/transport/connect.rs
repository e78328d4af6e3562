//! Connections of a vertex: with a light, or with a point of another surface.

use super::vertex::Vertex;
use crate::bsdf::ScatteringFunction;
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
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Emission times `f |cos|` of the vertex; black if nothing can arrive.
    pub value: Vec3,
    /// Density per steradian with which scattering finds the light, by any lobe but deltas.
    pub scatter_pdf: f32,
    /// The part of one lobe in that density, the probability of its selection included.
    pub lobe_pdf: f32,
    /// Cosine at an emitting surface, 1 of other lights.
    pub cos_light: f32,
    /// 1 of lights at infinity.
    pub distance_squared: f32,
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

impl Connection {
    /// Solid angle at the vertex per area at the light, `cos / distance²`, and 1 of lights at infinity: densities per steradian times
    /// this are per area.
    #[inline(always)]
    pub fn per_area(&self) -> f32 {
        num::div(self.cos_light, self.distance_squared)
    }
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

    /// What arrives from a point on a light.
    #[inline(always)]
    pub fn connect(&self, light: &LightSample) -> Connection {
        self.connect_by(light, 0)
    }

    /// What arrives from a point on a light, with the density of one lobe. Of a point of another surface
    /// ([`LightSample::surface`]) it is `f |cos|`, what joins a path to the rest of another one: the reconnection shift (Lehtinen
    /// et al. 2013; Lin et al. 2022, §5).
    #[inline(always)]
    pub fn connect_by(&self, light: &LightSample, lobe: u32) -> Connection {
        let far = light.at_infinity();
        let Reach { to: to_light, facing, shadow } =
            self.reach(light.position, light.normal, light.offset, far, light.key);
        let distance_squared = if far { 1.0 } else { dot(to_light, to_light) };
        let emits = (light.density > 0.0) & ((light.kind != LightKind::Area) | facing | light.two_sided);
        if !(emits & (distance_squared > MIN_DISTANCE_SQUARED)) {
            return Connection {
                direction: to_light,
                value: Vec3::ZERO,
                scatter_pdf: 0.0,
                lobe_pdf: 0.0,
                cos_light: 1.0,
                distance_squared: 1.0,
                shadow,
            };
        }
        let inv_distance = if far { 1.0 } else { num::rsqrt(distance_squared) };
        let wi = to_light * inv_distance;
        let local = self.frame.to_local(wi);
        let axis_cos = -dot(light.normal, wi);
        let cos_light = if light.kind == LightKind::Area { num::abs(axis_cos) } else { 1.0 };
        let falloff = if light.kind == LightKind::Point { light.spot_falloff(axis_cos) } else { 1.0 };
        let (scattered, lobe_pdf) = self.bsdf.evaluate_with_lobe(lobe, local);
        let value = flush(light.emission * falloff * scattered.value);
        Connection {
            direction: wi,
            value: if self.is_consistent(wi, local) { value } else { Vec3::ZERO },
            scatter_pdf: if light.is_punctual() { 0.0 } else { scattered.pdf },
            lobe_pdf,
            cos_light,
            distance_squared,
            shadow,
        }
    }
}
