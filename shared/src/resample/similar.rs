//! Which pixels reuse each other's samples: those whose surfaces lie almost in a plane and face almost the same way. Samples of other pixels
//! would do no harm but noise, and cost as much.
//!
//! ```
//! use restir_shared::glam::Vec3;
//! use restir_shared::resample::similar::{Facet, Similarity};
//!
//! let similarity = Similarity { max_plane_distance: 0.02, min_normal_cos: 0.9 };
//! let wall = |x: f32, z: f32| Facet { position: Vec3::new(x, 0.0, z), normal: Vec3::Z, distance: 10.0 };
//!
//! // anywhere on the same wall, but not on a step that is more than 0.02 times 10 away, nor around a corner
//! assert!(similarity.holds(&wall(0.0, 0.0), &wall(5.0, 0.1)));
//! assert!(!similarity.holds(&wall(0.0, 0.0), &wall(5.0, 0.3)));
//! assert!(!similarity.holds(&wall(0.0, 0.0), &Facet { normal: Vec3::X, ..wall(1.0, 0.0) }));
//! ```

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
