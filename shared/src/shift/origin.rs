//! Where paths begin.

use crate::geometry::{Hit, PackedHit, Ray};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// The first vertex of paths, in 32 bytes: a hit, and from where it is seen. All paths of a pixel have the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PathOrigin {
    /// The hit; its distance counts from where the segment began that ends here.
    pub hit: PackedHit,
    /// Unit direction of that segment.
    pub direction: [f32; 3],
    /// Zero.
    pub reserved: u32,
}

const _: () = assert!(size_of::<PathOrigin>() == 32);

impl PathOrigin {
    /// The origin of a pixel that sees nothing.
    pub const NONE: Self = Self { hit: PackedHit::MISS, direction: [0.0, 0.0, 1.0], reserved: 0 };

    /// The end of a ray of unit direction.
    #[inline(always)]
    pub fn new(ray: &Ray, hit: &Hit) -> Self {
        Self { hit: PackedHit::pack(hit), direction: ray.direction.to_array(), reserved: 0 }
    }

    /// The segment that ends here, as far as anything depends on it: on its direction alone.
    #[inline(always)]
    pub fn ray(&self) -> Ray {
        Ray { origin: Vec3::ZERO, direction: Vec3::from_array(self.direction), t_max: Ray::FAR, key: 0 }
    }
}
