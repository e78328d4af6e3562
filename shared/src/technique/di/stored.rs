//! A reservoir as it lies in a plane, 16 bytes.

use crate::num::{self, Scalar};
use crate::pack::{f32_from_half, half_from_f32};
use crate::scene::LightAddress;
use glam::UVec4;

/// The largest confidence that is kept.
const MAX_CONFIDENCE: f32 = 255.0;

/// What a pass leaves of a reservoir.
///
/// | word | bits | content |
/// |---|---|---|
/// | x | 24 + 8 | light, confidence weight as an integer |
/// | y | 24 + 8 | u, upper half of the visibility |
/// | z | 24 + 8 | v, lower half of the visibility |
/// | w | 32 | contribution weight, `f32` |
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stored {
    /// The sample; [`LightAddress::NONE`] if there is none.
    pub address: LightAddress,
    /// Its unbiased contribution weight: zero without a sample, and for one that was found to be occluded.
    pub contribution_weight: f32,
    /// Confidence weight, in frames: an integer from 0 to 255. A pixel whose candidates all failed counts, too.
    pub confidence: f32,
    /// Visibility of the sample at the pixel, or a mean of visibilities, in [0, 1]; 1 if it is not known. Kept as an IEEE
    /// half, whose relative steps let a mean decay; fixed-point ones would stop it at 4 %.
    pub visibility: f32,
}

impl Stored {
    /// No sample, and no confidence.
    pub const EMPTY: Self =
        Self { address: LightAddress::NONE, contribution_weight: 0.0, confidence: 0.0, visibility: 0.0 };

    /// The plane's word. A contribution weight that is no number, or out of range, is not kept: the reservoir is empty.
    #[inline(always)]
    pub fn pack(&self) -> UVec4 {
        let weight = self.contribution_weight.within_range();
        let sound = (weight >= 0.0) & (self.confidence >= 0.0);
        let confidence = num::nearest(num::clamp(self.confidence, 0.0, MAX_CONFIDENCE)) as u32;
        let visibility = half_from_f32(self.visibility);
        let word = UVec4::new(
            self.address.light | (confidence << 24),
            self.address.u | ((visibility >> 8) << 24),
            self.address.v | (visibility << 24),
            weight.to_bits(),
        );
        if sound { word } else { UVec4::new(LightAddress::NO_LIGHT, 0, 0, 0) }
    }

    /// The inverse of [`Self::pack`]. A word that it cannot have made is an empty reservoir.
    #[inline(always)]
    pub fn unpack(word: UVec4) -> Self {
        let contribution_weight = f32::from_bits(word.w);
        let visibility = f32_from_half(((word.y >> 24) << 8) | (word.z >> 24));
        let sound = (contribution_weight.within_range() == contribution_weight)
            & (contribution_weight >= 0.0)
            & (num::clamp(visibility, 0.0, 1.0) == visibility);
        let stored = Self {
            address: LightAddress { light: word.x & 0x00ff_ffff, u: word.y & 0x00ff_ffff, v: word.z & 0x00ff_ffff },
            contribution_weight,
            confidence: (word.x >> 24) as f32,
            visibility,
        };
        if sound { stored } else { Self::EMPTY }
    }

    /// Whether it has a sample that may contribute.
    #[inline(always)]
    pub fn has_sample(&self) -> bool {
        self.address.is_light() & (self.contribution_weight > 0.0)
    }
}
