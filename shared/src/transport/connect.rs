//! Connections of a vertex: with a light, or with a point of another surface.

use super::vertex::Vertex;
use crate::bsdf::ScatteringFunction;
use crate::geometry::Ray;
use crate::medium::transmittance;
use crate::num;
use crate::sampling::henyey_greenstein_between;
use crate::scene::{AddressedLight, LightKind, LightSample, Location};
use crate::vec::{dot, flush, max_component};
use glam::Vec3;

/// Points closer than 2^-40 count as the same: no light passes between them.
const MIN_DISTANCE_SQUARED: f32 = 8.271_806e-25;

/// Light from a sampled point, if nothing lies on the segment.
#[derive(Clone, Copy, Debug)]
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

impl Connection {
    /// Whether light arrives that the vertex scatters towards the path, if nothing lies on the segment.
    #[inline(always)]
    pub fn shines(&self) -> bool {
        max_component(self.value) > 0.0
    }
}

/// What passes a medium in the channel that passes best.
#[inline(always)]
pub fn passes(extinction: Vec3, distance: f32) -> f32 {
    num::exp(-(num::min(extinction.x, num::min(extinction.y, extinction.z)) * distance))
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
    /// With nothing.
    pub const NONE: Self = Self {
        direction: Vec3::Z,
        value: Vec3::ZERO,
        scatter_pdf: 0.0,
        lobe_pdf: 0.0,
        cos_light: 1.0,
        distance_squared: 1.0,
        shadow: Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: 1.0, key: 0 },
    };

    /// The same through `distance` of a medium. That scattering gets as far is taken to be as probable as it is in the channel that passes best
    /// ([`passes`]): which weights the balance heuristic has is arbitrary, as long as both ways to find light have the same.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn through(self, extinction: Vec3, distance: f32) -> Self {
        let left = transmittance(extinction, distance);
        Self { value: flush(self.value * left), scatter_pdf: self.scatter_pdf * max_component(left), ..self }
    }

    /// Solid angle at the vertex per area at the light, `cos / distance²`, and 1 of lights at infinity: densities per steradian times
    /// this are per area.
    #[doc(hidden)]
    #[inline(always)]
    pub fn per_area(&self) -> f32 {
        num::div(self.cos_light, self.distance_squared)
    }
}

impl Reach {
    /// The segment ends as far off the surface at the other end as it begins off this one.
    #[inline(always)]
    fn new(origin: Vec3, light: &LightSample) -> Self {
        let far = light.at_infinity();
        let to = if far { light.position } else { light.position - origin };
        let facing = dot(light.normal, to) < 0.0;
        let side = if facing { light.offset } else { -light.offset };
        let target = if far { to } else { (light.position + light.normal * side) - origin };
        let shadow = Ray { origin, direction: target, t_max: if far { Ray::FAR } else { 1.0 }, key: light.key };
        Self { to, facing, shadow }
    }

    #[inline(always)]
    fn distance_squared(&self, light: &LightSample) -> f32 {
        if light.at_infinity() { 1.0 } else { dot(self.to, self.to) }
    }

    /// Whether light can come this way, of this squared distance, if nothing lies on it.
    #[inline(always)]
    fn is_open(&self, light: &LightSample, distance_squared: f32) -> bool {
        let emits = (light.density > 0.0) & ((light.kind != LightKind::Area) | self.facing | light.two_sided);
        emits & (distance_squared > MIN_DISTANCE_SQUARED)
    }

    /// Nothing comes this way.
    #[inline(always)]
    fn closed(self) -> Connection {
        Connection { direction: self.to, shadow: self.shadow, ..Connection::NONE }
    }

    /// What comes this way; what the vertex makes of it is not known yet.
    #[inline(always)]
    fn connection(self, light: &LightSample, distance_squared: f32) -> Connection {
        let inv_distance = if light.at_infinity() { 1.0 } else { num::rsqrt(distance_squared) };
        let direction = self.to * inv_distance;
        let axis_cos = -dot(light.normal, direction);
        let cos_light = if light.kind == LightKind::Area { num::abs(axis_cos) } else { 1.0 };
        let falloff = if light.kind == LightKind::Point { light.spot_falloff(axis_cos) } else { 1.0 };
        let (value, shadow) = (light.emission * falloff, self.shadow);
        Connection { direction, value, scatter_pdf: 0.0, lobe_pdf: 0.0, cos_light, distance_squared, shadow }
    }
}

/// What arrives at a point inside of a medium, where paths that travel along the unit vector `direction` turn by the phase function of
/// Henyey and Greenstein. What the medium takes of it on its way is not considered ([`Connection::through`]). From lights at infinity
/// nothing comes unless it comes from `afar`, through the border.
#[inline(always)]
pub fn connect_inside(position: Vec3, direction: Vec3, anisotropy: f32, afar: bool, light: &LightSample) -> Connection {
    let reach = Reach::new(position, light);
    let distance_squared = reach.distance_squared(light);
    if !reach.is_open(light, distance_squared) | (light.at_infinity() & !afar) {
        return reach.closed();
    }
    let connection = reach.connection(light, distance_squared);
    let pdf = henyey_greenstein_between(direction, connection.direction, anisotropy);
    Connection {
        value: flush(connection.value * pdf),
        scatter_pdf: if light.is_punctual() { 0.0 } else { pdf },
        ..connection
    }
}

/// The shadow ray of [`Vertex::connect`] from a place on a surface.
#[inline(always)]
pub(crate) fn shadow_ray(at: &Location, light: &LightSample) -> Ray {
    let towards = if light.at_infinity() { light.position } else { light.position - at.position };
    let offset = if dot(at.normal, towards) < 0.0 { -at.offset } else { at.offset };
    Reach::new(at.position + at.normal * offset, light).shadow
}

impl Connection {
    /// Solid angle at the vertex per area of a light's parametrisation, of the light that this connects with: densities per steradian times this
    /// are over (light, u, v).
    #[inline(always)]
    pub(crate) fn spread(&self, light: &AddressedLight) -> f32 {
        if light.sample.kind == LightKind::Environment {
            light.extent
        } else {
            num::div(self.cos_light * light.extent, self.distance_squared)
        }
    }
}

impl<B: ScatteringFunction> Vertex<B> {
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
        let towards = if light.at_infinity() { light.position } else { light.position - self.position };
        let reach = Reach::new(self.origin(towards), light);
        let distance_squared = reach.distance_squared(light);
        if !reach.is_open(light, distance_squared) {
            return reach.closed();
        }
        let connection = reach.connection(light, distance_squared);
        let local = self.frame.to_local(connection.direction);
        let (scattered, lobe_pdf) = self.bsdf.evaluate_with_lobe(lobe, local);
        let value = flush(connection.value * scattered.value);
        Connection {
            value: if self.is_consistent(connection.direction, local) { value } else { Vec3::ZERO },
            scatter_pdf: if light.is_punctual() { 0.0 } else { scattered.pdf },
            lobe_pdf,
            ..connection
        }
    }
}
