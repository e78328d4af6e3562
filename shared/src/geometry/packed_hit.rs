//! Hits in buffers.

use super::Hit;
use crate::layout::NONE;
use bytemuck::{Pod, Zeroable};
use glam::{UVec4, Vec2};

/// A hit as it lies in a plane: t, id, u and v, floats as their bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct PackedHit(pub UVec4);

impl PackedHit {
    /// [`Hit::MISS`] at no distance.
    pub const MISS: Self = Self(UVec4::new(0, NONE, 0, 0));

    /// Packs a hit into 16 bytes, as planes hold it.
    #[inline(always)]
    pub fn pack(hit: &Hit) -> Self {
        Self(UVec4::new(hit.t.to_bits(), hit.id, hit.uv.x.to_bits(), hit.uv.y.to_bits()))
    }

    /// The hit that was packed, with the same bits.
    #[inline(always)]
    pub fn unpack(self) -> Hit {
        let UVec4 { x: t, y: id, z: u, w: v } = self.0;
        Hit { t: f32::from_bits(t), id, uv: Vec2::new(f32::from_bits(u), f32::from_bits(v)) }
    }
}
