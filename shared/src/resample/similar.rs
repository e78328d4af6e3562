//! Which pixels reuse each other's samples: those whose surfaces lie almost in a plane and face almost the same way. Samples of other pixels
//! would do no harm but noise, and cost as much.
//!
//! ```
//! use restir_shared::glam::Vec3;
//! use restir_shared::resample::similar::{GBufferSurface, Similarity};
//!
//! let similarity = Similarity { max_plane_distance: 0.02, min_normal_cos: 0.9 };
//! let wall = |x: f32, z: f32| GBufferSurface { position: Vec3::new(x, 0.0, z), normal: Vec3::Z, distance: 10.0 };
//!
//! // anywhere on the same wall, but not on a step that is more than 0.02 times 10 away, nor around a corner
//! assert!(similarity.holds(&wall(0.0, 0.0), &wall(5.0, 0.1)));
//! assert!(!similarity.holds(&wall(0.0, 0.0), &wall(5.0, 0.3)));
//! assert!(!similarity.holds(&wall(0.0, 0.0), &GBufferSurface { normal: Vec3::X, ..wall(1.0, 0.0) }));
//! ```

use crate::num;
use crate::vec::dot;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// What of the surface that a pixel sees decides on reuse.
#[derive(Clone, Copy, Debug)]
pub struct GBufferSurface {
    /// World position.
    pub position: Vec3,
    /// Unit geometric normal.
    pub normal: Vec3,
    /// Distance of the position to the camera.
    pub distance: f32,
}

/// A [`GBufferSurface`] as it lies in a plane, in 32 bytes. A pixel that sees no surface has a distance of 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PackedSurface {
    /// World position.
    pub position: [f32; 3],
    /// Its distance from the camera.
    pub distance: f32,
    /// Unit geometric normal.
    pub normal: [f32; 3],
    /// Zero.
    pub reserved: u32,
}

const _: () = assert!(size_of::<PackedSurface>() == 32);

impl PackedSurface {
    /// A pixel that sees no surface.
    pub const NONE: Self = Self { position: [0.0; 3], distance: 0.0, normal: [0.0; 3], reserved: 0 };

    /// For its place in a plane.
    #[doc(hidden)]
    #[inline(always)]
    pub fn pack(surface: &GBufferSurface) -> Self {
        let GBufferSurface { position, normal, distance } = *surface;
        Self { position: position.to_array(), distance, normal: normal.to_array(), reserved: 0 }
    }

    /// The inverse of [`Self::pack`].
    #[doc(hidden)]
    #[inline(always)]
    pub fn unpack(&self) -> GBufferSurface {
        let Self { position, distance, normal, .. } = *self;
        GBufferSurface { position: Vec3::from_array(position), normal: Vec3::from_array(normal), distance }
    }

    /// Whether there is a surface.
    #[doc(hidden)]
    #[inline(always)]
    pub fn exists(&self) -> bool {
        self.distance > 0.0
    }
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
    pub fn holds(&self, here: &GBufferSurface, there: &GBufferSurface) -> bool {
        let from_plane = num::abs(dot(here.normal, there.position - here.position));
        (dot(here.normal, there.normal) >= self.min_normal_cos)
            & (from_plane <= self.max_plane_distance * here.distance)
    }
}
