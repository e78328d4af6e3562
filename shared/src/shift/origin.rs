//! Where paths begin.

use crate::geometry::{Hit, PackedHit, Ray};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bits of the number of segments; the others are a length, without the low bits of its mantissa.
const SEGMENT_BITS: u32 = 8;
const SEGMENTS: u32 = (1 << SEGMENT_BITS) - 1;

/// The first vertex of paths, in 32 bytes: a hit, and from where it is seen. All paths of a pixel have the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PathOrigin {
    /// The hit; its distance counts from where the segment began that ends here.
    pub hit: PackedHit,
    /// Unit direction of that segment.
    pub direction: [f32; 3],
    /// What leads here from the camera: in the low 8 bits [`Self::segments`], in the others [`Self::reach`], in units of the scene.
    pub prefix: u32,
}

const _: () = assert!(size_of::<PathOrigin>() == 32);

impl PathOrigin {
    /// The origin of a pixel that sees nothing.
    pub const NONE: Self = Self { hit: PackedHit::MISS, direction: [0.0, 0.0, 1.0], prefix: 0 };

    /// The end of a camera ray of unit direction.
    #[inline(always)]
    pub fn new(ray: &Ray, hit: &Hit) -> Self {
        Self::of_prefix(ray, hit, 1, hit.t)
    }

    /// The end of the last of so many `segments`, at most 255, of which this is the ray; together they are `reach` long.
    #[inline(always)]
    pub fn of_prefix(ray: &Ray, hit: &Hit, segments: u32, reach: f32) -> Self {
        let prefix = (reach.to_bits() & !SEGMENTS) | segments;
        Self { hit: PackedHit::pack(hit), direction: ray.direction.to_array(), prefix }
    }

    /// Segments from the camera to here; 0 of a pixel that sees nothing.
    #[inline(always)]
    pub fn segments(&self) -> u32 {
        self.prefix & SEGMENTS
    }

    /// The length of these segments together, but for 2^-15 of it.
    #[inline(always)]
    pub fn reach(&self) -> f32 {
        f32::from_bits(self.prefix & !SEGMENTS)
    }

    /// The segment that ends here, as far as anything depends on it: on its direction alone.
    #[inline(always)]
    pub fn ray(&self) -> Ray {
        Ray { origin: Vec3::ZERO, direction: Vec3::from_array(self.direction), t_max: Ray::FAR, key: 0 }
    }
}
