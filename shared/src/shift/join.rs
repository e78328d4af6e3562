//! Where a path may be joined to another one.
//!
//! Joined at a segment, a path changes the direction at both of its ends. It is worth as much as before only if neither end minds: lobes
//! have to be rough, and the segment long. Lin et al. 2022, §7, ask for a least roughness and a least length; Lin et al. 2026 ("ReSTIR
//! PT Enhanced") for a footprint: the area over which the density of one vertex, seen from the other one, spreads a path. Whatever is
//! asked, it is asked of the path alone, so the shifted path answers for itself.

use crate::num;
use crate::rng;
use bytemuck::{Pod, Zeroable};
use glam::UVec4;

/// Where the hybrid shift joins paths. Thresholds of zero ask for nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Hybrid {
    /// The least perceptual roughness of the lobes at both ends of the segment.
    pub min_roughness: f32,
    /// The least length of the segment.
    pub min_distance: f32,
    /// c: footprints are at least this part, squared, of that of a camera ray that ends at the origin (0.02 in the paper). Each path
    /// has a c of its own, of a relative standard deviation of 0.2, so that no border shows.
    pub footprint: f32,
    /// r: the density of the direction is at most 1 / r² (0.1 in the paper), with a relative standard deviation of 0.01.
    pub spread: f32,
    /// Vertices that may be replayed. A path that needs more is not shifted.
    pub replays: u32,
}

crate::fields!(Hybrid: min_roughness, min_distance, footprint, spread, replays);

impl Hybrid {
    /// Reconnection alone: paths are joined at vertex 2, wherever no perfect lobe is concerned.
    pub const RECONNECTION: Self =
        Self { min_roughness: 0.0, min_distance: 0.0, footprint: 0.0, spread: 0.0, replays: 0 };
    /// Random replay alone, up to light that is sampled: that is the same light for all, so to find it again is to join it.
    pub const REPLAY: Self = Self { min_roughness: 2.0, replays: u32::MAX, ..Self::RECONNECTION };

    /// By roughness and distance (Lin et al. 2022).
    pub const fn new(min_roughness: f32, min_distance: f32) -> Self {
        Self { min_roughness, min_distance, replays: u32::MAX, ..Self::RECONNECTION }
    }

    /// By footprint (Lin et al. 2026).
    pub const fn by_footprint(footprint: f32, spread: f32) -> Self {
        Self { footprint, spread, ..Self::new(0.0, 0.0) }
    }

    /// The thresholds of a path with the given random words.
    #[doc(hidden)]
    #[inline(always)]
    pub fn of_path(&self, words: UVec4) -> Joins {
        let c = self.footprint * (1.0 + 0.2 * normal(words.x, words.y));
        let r = self.spread * (1.0 + 0.01 * normal(words.z, words.w));
        Joins {
            min_roughness: self.min_roughness,
            min_distance_squared: self.min_distance * self.min_distance,
            footprint: c * c,
            spread_squared: r * r,
        }
    }
}

const FOUR_PI: f32 = 12.566_371;
/// Keeps the footprint of a camera ray finite.
const MIN_COS: f32 = 1.0e-6;
const SQRT_3: f32 = 1.732_050_8;

/// Nearly normal, of mean 0 and variance 1: a sum of four uniform numbers, in [-3.5, 3.5].
#[inline(always)]
fn normal(a: u32, b: u32) -> f32 {
    let halves = |word: u32| rng::unit(word & 0xffff_0000) + rng::unit(word << 16);
    (halves(a) + halves(b) - 2.0) * SQRT_3
}

/// A vertex at an end of a segment.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// Perceptual roughness of the lobe by which the path leaves the vertex; 0 of a perfect one.
    pub roughness: f32,
    /// Density per steradian of the direction in which it leaves.
    pub pdf: f32,
    /// The cosine between the segment and the geometric normal.
    pub cos: f32,
}

impl End {
    /// Nothing is joined there.
    pub const NONE: Self = Self { roughness: 0.0, pdf: 0.0, cos: 1.0 };
}

/// The thresholds of one path.
#[derive(Clone, Copy, Debug)]
pub struct Joins {
    min_roughness: f32,
    min_distance_squared: f32,
    /// The least area of a footprint; before [`Joins::at_origin`], relative to that at the origin.
    footprint: f32,
    /// One over the largest density.
    spread_squared: f32,
}

impl Joins {
    /// The thresholds of a path that begins where a segment of length `t` ends under the cosine `cos`.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn at_origin(self, t: f32, cos: f32) -> Self {
        Self { footprint: self.footprint * num::div(FOUR_PI * (t * t), num::max(cos, MIN_COS)), ..self }
    }

    /// Whether paths may be joined at the segment from one surface to the next one.
    #[doc(hidden)]
    #[inline(always)]
    pub fn surfaces(&self, from: &End, to: &End, distance_squared: f32) -> bool {
        self.is_rough(from)
            & self.is_rough(to)
            & (from.pdf * self.spread_squared <= 1.0)
            & self.is_far(from.pdf * to.cos, distance_squared)
            & (distance_squared > self.footprint * (to.pdf * from.cos))
    }

    /// The same at the segment from a surface to a light that scattering has found, which lies there under the cosine `cos`. Lights
    /// have no lobes; at infinity they have no distance, either.
    #[doc(hidden)]
    #[inline(always)]
    pub fn light(&self, from: &End, cos: f32, distance_squared: f32, at_infinity: bool) -> bool {
        let reaches = if at_infinity {
            from.pdf * self.spread_squared <= 1.0
        } else {
            self.is_far(from.pdf * cos, distance_squared)
        };
        self.is_rough(from) & reaches
    }

    #[inline(always)]
    fn is_rough(&self, end: &End) -> bool {
        (end.roughness > 0.0) & (end.roughness >= self.min_roughness)
    }

    /// The footprint at the far end is distance² / (pdf cos).
    #[inline(always)]
    fn is_far(&self, pdf_cos: f32, distance_squared: f32) -> bool {
        (distance_squared >= self.min_distance_squared) & (distance_squared > self.footprint * pdf_cos)
    }
}
