//! A reservoir of a path as it lies in a plane, 64 bytes, and as what [`mutual`](crate::resample::mutual) merges.

use crate::geometry::Hit;
use crate::num::Scalar;
use crate::pack::{LOW_24 as LOW, decode_unit_vector_48, encode_unit_vector_48, unit_24, unit_from_24};
use crate::resample::mutual::{Record, ShiftResult};
use crate::resample::packed::count;
use crate::scene::LightAddress;
use crate::shift::Path;
use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec2, Vec3};

/// A reservoir as it lies in a plane.
///
/// | word | content |
/// |---|---|
/// | 0 | contribution weight, `f32` |
/// | 1 to 3 | the integrand, linear RGB, `f32` |
/// | 4 to 6 | light index, u, v where the light is kept ([`Path::keeps_light`]); else what arrives at vertex k, linear RGB, `f32` |
/// | 7 | term of the density, `f32` |
/// | 8 | pixel of the random numbers: 16 bits x, 16 bits y |
/// | 9 | sample of the random numbers |
/// | 10 | id of vertex k |
/// | 11 | 24 bits u of vertex k, 8 bits confidence |
/// | 12 | 24 bits v, 8 bits length |
/// | 13 | 24 bits of the direction from vertex k, 8 bits k |
/// | 14 | 24 bits of the direction, 8 bits first lobe |
/// | 15 | 8 bits second lobe, 1 bit: the light was sampled |
///
/// What decides where a path goes is stored as it is, but for the coordinates of vertex k, in 2^-24, and the direction, to
/// 6e-7 radians. Packing what was unpacked may give another code of the direction, so a path is moved on by
/// [`Record::moved`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct PackedPath {
    /// The words, in the order of the table above.
    pub words: [u32; 16],
}

const _: () = assert!(size_of::<PackedPath>() == 64);

/// What a pass leaves of a reservoir.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stored {
    /// The path; [`Path::NONE`] without one.
    pub path: Path,
    /// Its integrand at the pixel, in random numbers, linear RGB.
    pub value: Vec3,
    /// Its unbiased contribution weight; zero without a path.
    pub contribution_weight: f32,
    /// Confidence weight in frames, an integer from 0 to 255. A pixel whose candidates all failed counts, too.
    pub confidence: f32,
}

/// The longest path that is kept.
const MAX_LENGTH: u32 = 255;

impl Stored {
    /// The plane's words. A weight that is no number, or out of range, is not kept: there is no path then.
    #[inline(always)]
    pub fn pack(&self) -> PackedPath {
        let Self { path, value, contribution_weight, confidence } = *self;
        let seen = seen(&path);
        let [x, y] = encode_unit_vector_48(path.direction);
        let drawn = if path.light_sampled { 1 } else { 0 };
        let weight = contribution_weight.within_range();
        let sound = (weight > 0.0) & (path.length <= MAX_LENGTH);
        let length = if sound { path.length } else { 0 };
        PackedPath {
            words: [
                if sound { weight.to_bits() } else { 0 },
                value.x.to_bits(),
                value.y.to_bits(),
                value.z.to_bits(),
                seen[0],
                seen[1],
                seen[2],
                path.term.to_bits(),
                path.key.x,
                path.key.y,
                path.hit.id,
                unit_24(path.hit.uv.x) | (count(confidence) << 24),
                unit_24(path.hit.uv.y) | (length << 24),
                x | (path.reconnection << 24),
                y | (path.lobes[0] << 24),
                (path.lobes[1] & 0xff) | (drawn << 8),
            ],
        }
    }
}

impl PackedPath {
    /// The inverse of [`Stored::pack`].
    #[doc(hidden)]
    #[inline(always)]
    pub fn unpack(&self) -> Stored {
        let w = &self.words;
        let f = f32::from_bits;
        let course = self.course();
        let keeps_light = course.keeps_light();
        let path = Path {
            hit: Hit { id: w[10], uv: Vec2::new(unit_from_24(w[11]), unit_from_24(w[12])), ..Hit::MISS },
            direction: decode_unit_vector_48([w[13], w[14]]),
            radiance: if keeps_light { Vec3::ZERO } else { Vec3::new(f(w[4]), f(w[5]), f(w[6])) },
            light: if keeps_light { LightAddress { light: w[4], u: w[5], v: w[6] } } else { LightAddress::NONE },
            ..course
        };
        Stored {
            path,
            value: Vec3::new(f(w[1]), f(w[2]), f(w[3])),
            contribution_weight: f(w[0]),
            confidence: (w[11] >> 24) as f32,
        }
    }

    /// See [`KeptPath::course`](crate::shift::KeptPath::course).
    #[inline(always)]
    pub(super) fn course(&self) -> Path {
        let w = &self.words;
        Path {
            key: UVec2::new(w[8], w[9]),
            length: w[12] >> 24,
            reconnection: w[13] >> 24,
            light_sampled: w[15] & 0x100 != 0,
            lobes: [w[14] >> 24, w[15] & 0xff],
            term: f32::from_bits(w[7]),
            ..Path::NONE
        }
    }

    /// The path in another frame, where its light may have another index, where something else may arrive at vertex k, and where it has this
    /// term. Of what is no path the words say nothing, and stay.
    #[inline(always)]
    #[must_use]
    pub(super) fn carried(&self, path: &Path, term: f32) -> Self {
        let mut carried = *self;
        if path.length == 0 {
            return carried;
        }
        let seen = seen(path);
        carried.words[4] = seen[0];
        carried.words[5] = seen[1];
        carried.words[6] = seen[2];
        carried.words[7] = term.to_bits();
        carried
    }
}

impl Record for PackedPath {
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
        (self.words[11] >> 24) as f32
    }

    /// See [`Path::term`].
    #[inline(always)]
    fn partial_jacobian(&self) -> f32 {
        f32::from_bits(self.words[7])
    }

    #[inline(always)]
    fn moved(&self, to: &ShiftResult) -> Self {
        let mut moved = *self;
        moved.words[1] = to.value[0].to_bits();
        moved.words[2] = to.value[1].to_bits();
        moved.words[3] = to.value[2].to_bits();
        moved.words[7] = to.partial_jacobian.to_bits();
        moved
    }

    #[inline(always)]
    fn weighted(&self, contribution_weight: f32, confidence: f32) -> Self {
        let weight = contribution_weight.within_range();
        let mut weighted = *self;
        weighted.words[0] = weight.to_bits();
        weighted.words[11] = (self.words[11] & LOW) | (count(confidence) << 24);
        weighted.words[12] = if weight > 0.0 { self.words[12] } else { self.words[12] & LOW };
        weighted
    }
}

/// What is seen from vertex k, or is vertex k: words 4 to 6.
#[inline(always)]
fn seen(path: &Path) -> [u32; 3] {
    let Path { light: kept, radiance, .. } = *path;
    if path.keeps_light() {
        [kept.light, kept.u, kept.v]
    } else {
        [radiance.x.to_bits(), radiance.y.to_bits(), radiance.z.to_bits()]
    }
}
