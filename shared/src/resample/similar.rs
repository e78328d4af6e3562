//! Which pixels reuse each other's samples.

use crate::num;
use crate::vec::dot;
use glam::Vec3;

/// What of a surface decides on reuse.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// World position.
    pub position: Vec3,
    /// Unit geometric normal.
    pub normal: Vec3,
    /// Distance of the position to the camera.
    pub distance: f32,
}

/// How alike surfaces have to be.
#[derive(Clone, Copy, Debug)]
pub struct Similarity {
    /// The other's distance from the tangent plane is at most this part of the distance to the camera.
    pub max_plane_distance: f32,
    /// The normals have at least this cosine.
    pub min_normal_cos: f32,
}

impl Similarity {
    /// Whether reuse from `there` pays `here`. It depends on nothing but surfaces, so it is unbiased.
    #[inline(always)]
    pub fn holds(&self, here: &Facet, there: &Facet) -> bool {
        let from_plane = num::abs(dot(here.normal, there.position - here.position));
        (dot(here.normal, there.normal) >= self.min_normal_cos)
            & (from_plane <= self.max_plane_distance * here.distance)
    }
}
