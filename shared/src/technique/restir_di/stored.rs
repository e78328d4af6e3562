//! A reservoir as it lies in a plane, 16 bytes.

use crate::num::{self, Scalar};
use crate::resample::packed::{self, count, pack_visibility, unpack_visibility};
use crate::scene::LightAddress;
use bytemuck::{Pod, Zeroable};
use glam::{UVec4, Vec3};

/// A reservoir as it lies in a plane.
///
/// | word | bits | content |
/// |---|---|---|
/// | x | 24 + 8 | light, confidence weight as an integer |
/// | y | 24 + 8 | u, upper byte of the visibility |
/// | z | 24 + 8 | v, lower byte of the visibility |
/// | w | 32 | contribution weight, `f32` |
///
/// The 16 bits of the visibility are those of [`pack_visibility`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct PackedReservoir(pub UVec4);

/// What a pass leaves of a reservoir. Without a sample its address is [`LightAddress::NONE`].
pub type Stored = packed::Stored<LightAddress>;

impl Stored {
    /// No sample, and no confidence.
    pub const EMPTY: Self =
        Self { sample: LightAddress::NONE, contribution_weight: 0.0, confidence: 0.0, visibility: Vec3::ZERO };

    /// The plane's word. A contribution weight that is no number, or out of range, is not kept: the reservoir is empty.
    #[inline(always)]
    pub fn pack(&self) -> PackedReservoir {
        let weight = self.contribution_weight.within_range();
        let sound = (weight >= 0.0) & (self.confidence >= 0.0);
        let confidence = count(self.confidence);
        let visibility = pack_visibility(self.visibility);
        let word = UVec4::new(
            self.sample.light | (confidence << 24),
            self.sample.u | ((visibility >> 8) << 24),
            self.sample.v | (visibility << 24),
            weight.to_bits(),
        );
        PackedReservoir(if sound { word } else { UVec4::new(LightAddress::NO_LIGHT, 0, 0, 0) })
    }

    /// The inverse of [`Self::pack`]. A word that it cannot have made is an empty reservoir.
    #[inline(always)]
    pub fn unpack(PackedReservoir(word): PackedReservoir) -> Self {
        let contribution_weight = f32::from_bits(word.w);
        let visibility = unpack_visibility(((word.y >> 24) << 8) | (word.z >> 24));
        let sound = (contribution_weight.within_range() == contribution_weight)
            & (contribution_weight >= 0.0)
            & (num::clamp(visibility.x, 0.0, 1.0) == visibility.x);
        let stored = Self {
            sample: LightAddress { light: word.x & 0x00ff_ffff, u: word.y & 0x00ff_ffff, v: word.z & 0x00ff_ffff },
            contribution_weight,
            confidence: (word.x >> 24) as f32,
            visibility,
        };
        if sound { stored } else { Self::EMPTY }
    }

    /// Whether it has a sample that may contribute.
    #[inline(always)]
    pub fn has_sample(&self) -> bool {
        self.sample.is_light() & (self.contribution_weight > 0.0)
    }
}
