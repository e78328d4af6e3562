//! Interiors that absorb.

use crate::geometry::Ray;
use crate::layout::FEATURE_VOLUME;
use crate::medium::transmittance;
use crate::scene::SurfacePoint;
use crate::vec::{dot, flush};
use glam::Vec3;

/// Whether an interior absorbs along the segment that ends at `point`: one does, if that is the back of a surface.
#[inline(always)]
pub fn absorbs<M>(point: &SurfacePoint<M>, ray: &Ray, features: u32) -> bool {
    features & FEATURE_VOLUME != 0 && dot(point.normal, ray.direction) > 0.0
}

/// What is left of a throughput after the segment of length `t` along `ray`, of unit direction, that ends at `point`.
#[inline(always)]
pub fn through_interior<M>(throughput: Vec3, point: &SurfacePoint<M>, ray: &Ray, t: f32, features: u32) -> Vec3 {
    if absorbs(point, ray, features) { flush(throughput * transmittance(point.absorption, t)) } else { throughput }
}
