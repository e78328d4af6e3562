//! A reservoir of a sample under the surface as it lies in a plane, 48 bytes, and as what [`mutual`](crate::resample::mutual)
//! merges.

use crate::diffusion::DiskNumbers;
use crate::geometry::Hit;
use crate::num::{self, Scalar};
use crate::pack::{LOW_24, floor_24, unit_24, unit_from_24};
use crate::resample::mutual::{Record, ShiftResult};
use crate::resample::packed::count;
use crate::scene::LightAddress;
use crate::vec::luminance;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// A reservoir as it lies in a plane.
///
/// | word | content |
/// |---|---|
/// | 0 | contribution weight, `f32` |
/// | 1 to 3 | the integrand, linear RGB, `f32` |
/// | 4 | partial Jacobian, `f32` |
/// | 5 | id of the point |
/// | 6 | 24 bits u of the point, 8 bits confidence |
/// | 7 | 24 bits v, 2 bits axis, 2 bits channel, 4 bits crossing |
/// | 8 | 24 bits light, bits 16 to 23 of the radius |
/// | 9 | 24 bits u of the light, bits 8 to 15 of the radius |
/// | 10 | 24 bits v of the light, bits 0 to 7 of the radius |
/// | 11 | 24 bits turn, 2 bits [`Kind`] |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct PackedSubsurface {
    /// The words, in the order of the table above.
    pub words: [u32; 12],
}

const _: () = assert!(size_of::<PackedSubsurface>() == 48);

/// What a shift does with a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    /// Reconnection: the point stays.
    Kept,
    /// Delayed reconnection: the segment's random numbers find a point around the other entry, and the light stays.
    Replayed,
    /// The point is the entry, where the surface is Lambertian: it becomes the other entry, and the light stays.
    AtEntry,
}

/// A point of a body's surface at which light enters, and the light that shines on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Its id and coordinates. Of a [replayed](Kind::Replayed) sample that was shifted they are those of a point that it had before.
    pub hit: Hit,
    /// The light.
    pub light: LightAddress,
    /// By which a segment finds the point.
    pub numbers: DiskNumbers,
    /// Which of the segment's hits it is, from 0.
    pub crossing: u32,
    /// What a shift does with it.
    pub kind: Kind,
    /// If it is [replayed](Kind::Replayed), the probability of its channel over the density of the point over its address, else 1: the Jacobian of a shift
    /// is that after it over that before it.
    pub partial_jacobian: f32,
}

impl Sample {
    /// None.
    pub const NONE: Self = Self {
        hit: Hit::MISS,
        light: LightAddress::NONE,
        numbers: DiskNumbers::NONE,
        crossing: 0,
        kind: Kind::Kept,
        partial_jacobian: 1.0,
    };
}

impl Sample {
    /// The numbers as a plane has them.
    #[inline(always)]
    pub(super) fn stored_numbers(numbers: &DiskNumbers) -> DiskNumbers {
        let stored = |x: f32| unit_from_24(floor_24(x));
        DiskNumbers { radius: stored(numbers.radius), turn: stored(numbers.turn), ..*numbers }
    }
}

/// What a pass leaves of a reservoir.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stored {
    /// What was chosen; anything, if the contribution weight is zero.
    pub sample: Sample,
    /// Its integrand at the pixel over the addresses of its point and its light, linear RGB, with visibility.
    pub value: Vec3,
    /// Its unbiased contribution weight; zero without a sample, and for one that was found to be occluded.
    pub contribution_weight: f32,
    /// Confidence weight in frames, an integer from 0 to 255. A pixel whose candidates all failed counts, too.
    pub confidence: f32,
}

impl Stored {
    /// The plane's words. A weight that is no number, or out of range, is not kept: there is no sample then.
    #[inline(always)]
    pub fn pack(&self) -> PackedSubsurface {
        let Self { sample, value, contribution_weight, confidence } = *self;
        let Sample { hit, light, numbers, crossing, kind, partial_jacobian } = sample;
        let radius = floor_24(numbers.radius);
        let whole = (numbers.axis & 3) | ((numbers.channel & 3) << 2) | ((crossing & 15) << 4);
        PackedSubsurface {
            words: [
                contribution_weight.within_range().to_bits(),
                value.x.to_bits(),
                value.y.to_bits(),
                value.z.to_bits(),
                partial_jacobian.to_bits(),
                hit.id,
                unit_24(hit.uv.x) | (count(confidence) << 24),
                unit_24(hit.uv.y) | (whole << 24),
                (light.light & LOW_24) | ((radius >> 16) << 24),
                (light.u & LOW_24) | ((radius >> 8) << 24),
                (light.v & LOW_24) | (radius << 24),
                floor_24(numbers.turn) | ((kind as u32) << 24),
            ],
        }
    }
}

impl PackedSubsurface {
    /// The inverse of [`Stored::pack`].
    #[inline(always)]
    pub fn unpack(&self) -> Stored {
        let w = &self.words;
        let radius = ((w[8] >> 24) << 16) | ((w[9] >> 24) << 8) | (w[10] >> 24);
        let whole = w[7] >> 24;
        let sample = Sample {
            hit: Hit { id: w[5], uv: Vec2::new(unit_from_24(w[6]), unit_from_24(w[7])), ..Hit::MISS },
            light: LightAddress { light: w[8] & LOW_24, u: w[9] & LOW_24, v: w[10] & LOW_24 },
            numbers: DiskNumbers {
                axis: whole & 3,
                channel: (whole >> 2) & 3,
                radius: unit_from_24(radius),
                turn: unit_from_24(w[11]),
            },
            crossing: whole >> 4,
            kind: kind(w[11] >> 24),
            partial_jacobian: self.partial_jacobian(),
        };
        Stored {
            sample,
            value: self.value(),
            contribution_weight: self.contribution_weight(),
            confidence: self.confidence(),
        }
    }

    /// The sample with this light in place of its own.
    #[inline(always)]
    #[must_use]
    pub(super) fn lit_by(&self, light: LightAddress) -> Self {
        let mut lit = *self;
        lit.words[8] = (light.light & LOW_24) | (self.words[8] & !LOW_24);
        lit.words[9] = (light.u & LOW_24) | (self.words[9] & !LOW_24);
        lit.words[10] = (light.v & LOW_24) | (self.words[10] & !LOW_24);
        lit
    }
}

impl Record for PackedSubsurface {
    #[inline(always)]
    fn value(&self) -> Vec3 {
        Vec3::new(f32::from_bits(self.words[1]), f32::from_bits(self.words[2]), f32::from_bits(self.words[3]))
    }

    #[inline(always)]
    fn contribution_weight(&self) -> f32 {
        f32::from_bits(self.words[0])
    }

    #[inline(always)]
    fn confidence(&self) -> f32 {
        (self.words[6] >> 24) as f32
    }

    /// See [`Sample::partial_jacobian`].
    #[inline(always)]
    fn partial_jacobian(&self) -> f32 {
        f32::from_bits(self.words[4])
    }

    /// The luminance of what the sample is worth, whatever its sign: a profile less what has scattered once may be negative.
    #[inline(always)]
    fn target(value: Vec3) -> f32 {
        luminance(Vec3::new(num::abs(value.x), num::abs(value.y), num::abs(value.z)))
    }

    #[inline(always)]
    fn moved(&self, to: &ShiftResult) -> Self {
        let mut moved = *self;
        moved.words[1] = to.value[0].to_bits();
        moved.words[2] = to.value[1].to_bits();
        moved.words[3] = to.value[2].to_bits();
        moved.words[4] = to.partial_jacobian.to_bits();
        moved
    }

    #[inline(always)]
    fn weighted(&self, contribution_weight: f32, confidence: f32) -> Self {
        let mut weighted = *self;
        weighted.words[0] = contribution_weight.within_range().to_bits();
        weighted.words[6] = (self.words[6] & LOW_24) | (count(confidence) << 24);
        weighted
    }
}

#[inline(always)]
fn kind(word: u32) -> Kind {
    if word == Kind::Kept as u32 {
        Kind::Kept
    } else if word == Kind::Replayed as u32 {
        Kind::Replayed
    } else {
        Kind::AtEntry
    }
}
