//! Triangles that are not everywhere.

use super::{Hit, Ray};

/// What says which hits count, of triangles that are marked ([`TRIANGLE_ALPHA`](crate::layout::TRIANGLE_ALPHA)); of others all do.
pub trait Coverage {
    /// Whether the ray meets the triangle where it hits it: a function of the arguments alone.
    fn covers(&self, ray: &Ray, hit: &Hit) -> bool;
}

/// Every hit counts.
#[derive(Clone, Copy, Debug)]
pub struct Solid;

impl Coverage for Solid {
    #[inline(always)]
    fn covers(&self, _ray: &Ray, _hit: &Hit) -> bool {
        true
    }
}

impl Coverage for &dyn Coverage {
    fn covers(&self, ray: &Ray, hit: &Hit) -> bool {
        (**self).covers(ray, hit)
    }
}
