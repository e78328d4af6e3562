//! Paths that can be shifted.

use crate::geometry::Hit;
use crate::scene::LightAddress;
use glam::{UVec2, Vec3};

/// A path from a [`PathOrigin`](super::PathOrigin) to a light, as far as a shift has to know it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path {
    /// Whose random numbers made it: a pixel and a sample, as a technique has them.
    pub key: UVec2,
    /// The index of its last vertex, the light; the origin is vertex 1.
    pub length: u32,
    /// k, the index of the vertex from which on the path is kept, from 2 to `length`; 0 if there is none.
    pub reconnection: u32,
    /// The light was sampled; otherwise scattering found it.
    pub light_sampled: bool,
    /// The lobes that gave the directions from vertex k - 1 and from vertex k; lights that are sampled need none.
    pub lobes: [u32; 2],
    /// Vertex k, if it is not the light.
    pub hit: Hit,
    /// Unit direction from vertex k, if what follows is not the light.
    pub direction: Vec3,
    /// What arrives there from that direction.
    pub radiance: Vec3,
    /// The light, if it is vertex k or the next one.
    pub light: LightAddress,
    /// The part of the path's density in which its predecessors enter, see the [module](super). Zero of a path that no shift takes
    /// anywhere.
    pub term: f32,
}

impl Path {
    /// No path, which is what a pixel has that found no light.
    pub const NONE: Self = Self {
        key: UVec2::ZERO,
        length: 0,
        reconnection: 0,
        light_sampled: false,
        lobes: [0; 2],
        hit: Hit::MISS,
        direction: Vec3::Z,
        radiance: Vec3::ZERO,
        light: LightAddress::NONE,
        term: 0.0,
    };

    /// Whether the light itself is kept, and not only what arrives of it.
    #[doc(hidden)]
    #[inline(always)]
    pub fn keeps_light(&self) -> bool {
        (self.reconnection != 0) & (self.reconnection + 1 >= self.length)
    }

    /// Whether what arrives at vertex k is kept, and not the light: that is neither vertex k nor the next one.
    #[doc(hidden)]
    #[inline(always)]
    pub fn keeps_arrival(&self) -> bool {
        (self.reconnection != 0) & (self.reconnection + 1 < self.length)
    }

    /// Whether vertex k is a surface, and not the light.
    #[doc(hidden)]
    #[inline(always)]
    pub fn keeps_surface(&self) -> bool {
        (self.reconnection != 0) & (self.reconnection < self.length)
    }

    /// The last vertex that random replay finds.
    #[doc(hidden)]
    #[inline(always)]
    pub fn last_replayed(&self) -> u32 {
        if self.reconnection == 0 { self.length } else { self.reconnection.wrapping_sub(1) }
    }
}

/// A path as it lies in a plane. A shift asks for its parts where it needs them, again and again: kept while a ray is traced, they would take
/// registers of a GPU. It gives the same path whenever it is asked.
pub trait KeptPath {
    /// The path; its hit, direction, radiance and light may be those of [`Path::NONE`].
    fn course(&self) -> Path;
    /// The whole path.
    fn path(&self) -> Path;
}

impl KeptPath for Path {
    #[inline(always)]
    fn course(&self) -> Path {
        *self
    }

    #[inline(always)]
    fn path(&self) -> Path {
        *self
    }
}
