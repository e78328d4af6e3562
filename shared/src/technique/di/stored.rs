//! A reservoir as it lies in a plane, 16 bytes.

use crate::num::{self, Scalar};
use crate::pack::{f32_from_half, half_from_f32};
use crate::scene::LightAddress;
use glam::{UVec4, Vec3};

/// The visibility has a colour.
const COLOURED: u32 = 1 << 15;
/// The largest confidence that is kept.
const MAX_CONFIDENCE: f32 = 255.0;

/// What a pass leaves of a reservoir.
///
/// | word | bits | content |
/// |---|---|---|
/// | x | 24 + 8 | light, confidence weight as an integer |
/// | y | 24 + 8 | u, upper byte of the visibility |
/// | z | 24 + 8 | v, lower byte of the visibility |
/// | w | 32 | contribution weight, `f32` |
///
/// The 16 bits of the visibility are an IEEE half if it is the same in all channels. Halves in [0, 1] do not need the
/// highest bit: where it is set, five bits each are red, green and blue, on a [lattice](Self::LEVELS).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stored {
    /// The sample; [`LightAddress::NONE`] if there is none.
    pub address: LightAddress,
    /// Its unbiased contribution weight: zero without a sample, and for one that was found to be occluded.
    pub contribution_weight: f32,
    /// Confidence weight, in frames: an integer from 0 to 255. A pixel whose candidates all failed counts, too.
    pub confidence: f32,
    /// Visibility of the sample at the pixel, or a mean of visibilities, by channel in [0, 1]; 1 if it is not known. A half's
    /// relative steps let a mean decay, where fixed-point ones would stop it at 4 %; what has a colour is
    /// [`dithered`] for that.
    pub visibility: Vec3,
}

/// A visibility by channel on the lattice of what is stored, with the same expectation over a uniform `u` in [0, 1). Grey
/// stays as it is.
#[inline(always)]
pub fn dithered(visibility: Vec3, u: f32) -> Vec3 {
    let on_lattice = |x: f32| lattice(num::min(x * Stored::LEVELS + u, Stored::LEVELS) as u32);
    if is_grey(visibility) {
        visibility
    } else {
        Vec3::new(on_lattice(visibility.x), on_lattice(visibility.y), on_lattice(visibility.z))
    }
}

#[inline(always)]
fn is_grey(v: Vec3) -> bool {
    (v.x == v.y) & (v.y == v.z)
}

#[inline(always)]
fn lattice(level: u32) -> f32 {
    const STEP: f32 = 1.0 / Stored::LEVELS;
    level as f32 * STEP
}

/// 16 bits, see [`Stored`].
#[inline(always)]
fn pack_visibility(visibility: Vec3) -> u32 {
    let level = |x: f32| num::nearest(num::clamp(x, 0.0, 1.0) * Stored::LEVELS) as u32;
    let colour = COLOURED | (level(visibility.x) << 10) | (level(visibility.y) << 5) | level(visibility.z);
    if is_grey(visibility) { half_from_f32(visibility.x) } else { colour }
}

#[inline(always)]
fn unpack_visibility(bits: u32) -> Vec3 {
    if bits & COLOURED == 0 {
        Vec3::splat(f32_from_half(bits))
    } else {
        Vec3::new(lattice((bits >> 10) & 31), lattice((bits >> 5) & 31), lattice(bits & 31))
    }
}

impl Stored {
    /// Steps of the lattice on which a channel of a coloured visibility lies.
    pub const LEVELS: f32 = 31.0;
    /// No sample, and no confidence.
    pub const EMPTY: Self =
        Self { address: LightAddress::NONE, contribution_weight: 0.0, confidence: 0.0, visibility: Vec3::ZERO };

    /// The plane's word. A contribution weight that is no number, or out of range, is not kept: the reservoir is empty.
    #[inline(always)]
    pub fn pack(&self) -> UVec4 {
        let weight = self.contribution_weight.within_range();
        let sound = (weight >= 0.0) & (self.confidence >= 0.0);
        let confidence = num::nearest(num::clamp(self.confidence, 0.0, MAX_CONFIDENCE)) as u32;
        let visibility = pack_visibility(self.visibility);
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
        let visibility = unpack_visibility(((word.y >> 24) << 8) | (word.z >> 24));
        let sound = (contribution_weight.within_range() == contribution_weight)
            & (contribution_weight >= 0.0)
            & (num::clamp(visibility.x, 0.0, 1.0) == visibility.x);
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
