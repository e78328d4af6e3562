//! Interiors that absorb.

use crate::geometry::Ray;
use crate::layout::FEATURE_VOLUME;
use crate::medium::transmittance;
use crate::scene::SurfacePoint;
use crate::vec::{dot, flush};
use glam::Vec3;

/// What is left of a throughput after the segment of length `t` along `ray`, of unit direction, that ends at `point`: interiors
/// absorb along segments that end at the back of a surface.
#[inline(always)]
pub fn through_interior<M>(throughput: Vec3, point: &SurfacePoint<M>, ray: &Ray, t: f32, features: u32) -> Vec3 {
    if features & FEATURE_VOLUME != 0 && dot(point.normal, ray.direction) > 0.0 {
        flush(throughput * transmittance(point.absorption, t))
    } else {
        throughput
    }
}
