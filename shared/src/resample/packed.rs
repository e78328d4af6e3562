//! What a reservoir is between two passes ([`Stored`]), and how a visibility takes 16 bits of it. A technique packs the sample itself,
//! for only it knows what that is.
//!
//! ```
//! use restir_shared::glam::Vec3;
//! use restir_shared::resample::packed::{dithered, pack_visibility, unpack_visibility};
//!
//! // grey is kept as a half
//! assert_eq!(unpack_visibility(pack_visibility(Vec3::splat(0.125))), Vec3::splat(0.125));
//!
//! // a colour is rounded to steps of 1/31, up or down by a random number, so that its mean stays what it is
//! let glass = Vec3::new(1.0, 0.62, 0.1);
//! let kept = |i: u32| unpack_visibility(pack_visibility(dithered(glass, (i as f32 + 0.5) / 256.0)));
//! let mean = (0..256).map(kept).sum::<Vec3>() / 256.0;
//! assert!((mean - glass).abs().max_element() < 1e-3);
//! ```

use crate::num;
use crate::pack::{f32_from_half, half_from_f32};
use glam::Vec3;

/// The largest confidence that a packed reservoir keeps, in frames: it is an integer of 8 bits.
pub const MAX_CONFIDENCE: f32 = 255.0;
/// A confidence weight in 8 bits.
#[inline(always)]
pub(crate) fn count(confidence: f32) -> u32 {
    num::nearest(num::clamp(confidence, 0.0, MAX_CONFIDENCE)) as u32
}

/// The visibility has a colour.
const COLOURED: u32 = 1 << 15;
/// Steps of the lattice on which a channel of a coloured visibility lies.
pub const LEVELS: f32 = 31.0;

/// What a pass leaves of a reservoir.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stored<S> {
    /// What was chosen; anything, if the contribution weight is zero.
    pub sample: S,
    /// Its unbiased contribution weight: zero without a sample, and for one that was found to be occluded.
    pub contribution_weight: f32,
    /// Confidence weight, in frames: an integer from 0 to [`MAX_CONFIDENCE`]. A pixel whose candidates all failed counts, too.
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
    let on_lattice = |x: f32| lattice(num::min(x * LEVELS + u, LEVELS) as u32);
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
    const STEP: f32 = 1.0 / LEVELS;
    level as f32 * STEP
}

/// A visibility in 16 bits: an IEEE half if it is the same in all channels. Halves in [0, 1] do not need the highest bit: where
/// it is set, five bits each are red, green and blue, on a [lattice](LEVELS).
#[inline(always)]
pub fn pack_visibility(visibility: Vec3) -> u32 {
    let level = |x: f32| num::nearest(num::clamp(x, 0.0, 1.0) * LEVELS) as u32;
    let colour = COLOURED | (level(visibility.x) << 10) | (level(visibility.y) << 5) | level(visibility.z);
    if is_grey(visibility) { half_from_f32(visibility.x) } else { colour }
}

/// The inverse of [`pack_visibility`].
#[inline(always)]
pub fn unpack_visibility(bits: u32) -> Vec3 {
    if bits & COLOURED == 0 {
        Vec3::splat(f32_from_half(bits))
    } else {
        Vec3::new(lattice((bits >> 10) & 31), lattice((bits >> 5) & 31), lattice(bits & 31))
    }
}
