//! Straight ways through clear glass.

use crate::bsdf::Scattering;
use crate::geometry::{Hit, Ray};
use crate::num;
use crate::scene::{Surface, SurfacePoint, Trace};
use crate::vec::{dot, flush, max_component};
use glam::Vec3;

/// A way passes at most as many sheets of glass: what lies behind more is not seen.
const MAX_SHEETS: u32 = 12;
/// The most stretches of a way, each of which is a ray.
#[cfg(not(target_arch = "spirv"))]
pub(crate) const MAX_STRETCHES: u32 = MAX_SHEETS + 1;

/// A straight way to the first surface that lets nothing through.
#[derive(Debug)]
pub struct Passage {
    /// That surface.
    pub hit: Hit,
    /// The last stretch of the way, which hits it.
    pub ray: Ray,
    /// What is left of light that comes this way, in [0, 1].
    pub transmittance: Vec3,
}

/// Follows a ray, of t_max 1 or [`Ray::FAR`]. Unless it goes `through_glass`, everything that it hits ends the way.
#[inline(always)]
pub fn follow<S: Trace + Surface>(scene: &S, through_glass: bool, ray: &Ray) -> Passage {
    let end = ray.origin + ray.direction;
    let mut passage = Passage::begin(ray);
    let mut sheets = 0;
    let mut open = true;
    while open {
        passage.hit = scene.closest(&passage.ray);
        open = passage.hit.is_hit() & through_glass & (sheets < MAX_SHEETS);
        if open {
            let direction = ray.direction * num::rsqrt(dot(ray.direction, ray.direction));
            let point = scene.sheet(&passage.ray, &passage.hit);
            let passed = straight(&point, direction);
            open = max_component(passed) > 0.0;
            if open {
                let offset = if dot(point.normal, direction) < 0.0 { -point.offset } else { point.offset };
                let origin = point.position + point.normal * offset;
                let direction = if ray.t_max == Ray::FAR { ray.direction } else { end - origin };
                passage.ray = Ray { origin, direction, ..*ray };
                passage.transmittance = flush(passage.transmittance * passed);
            }
        }
        sheets += 1;
    }
    passage
}

/// What passes straight through a point, of light along the unit vector `direction`: nothing but at clear glass, which does
/// not emit. The angle is that to the geometric normal.
#[inline(always)]
fn straight<M: Scattering>(point: &SurfacePoint<M>, direction: Vec3) -> Vec3 {
    let passed = flush(point.material.straight(num::abs(dot(point.normal, direction))));
    if max_component(point.emission) > 0.0 { Vec3::ZERO } else { passed }
}

impl Passage {
    /// Nothing but a beginning.
    #[inline(always)]
    pub fn begin(ray: &Ray) -> Self {
        Self { hit: Hit::MISS, ray: *ray, transmittance: Vec3::ONE }
    }

    /// What of the light of a shadow ray arrives.
    #[inline(always)]
    pub fn arriving(&self) -> Vec3 {
        if self.hit.is_hit() | self.hit.is_cut() { Vec3::ZERO } else { self.transmittance }
    }
}

/// What of the light of a shadow ray arrives: where it goes `through_glass` by channel, in [0, 1], else all or nothing.
#[inline(always)]
pub fn transmittance<S: Trace + Surface>(scene: &S, through_glass: bool, shadow: &Ray) -> Vec3 {
    if through_glass {
        follow(scene, through_glass, shadow).arriving()
    } else if scene.occluded(shadow) {
        Vec3::ZERO
    } else {
        Vec3::ONE
    }
}
