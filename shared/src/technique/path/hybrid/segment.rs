//! The random numbers by which points of a profile are found.

use crate::geometry::Crossings;
use crate::rng::Rng;
use glam::UVec4;

/// Random dimensions of the first segment, and how many each has: its own, of the choice of points, and of each point a light and a
/// direction.
const SEGMENTS: u32 = 1 << 23;
const PER_SEGMENT: u32 = 64;
const CHOICE: u32 = 1;
const POINTS: u32 = 8;
const _: () = assert!(POINTS + 2 * (Crossings::LISTED as u32 + 1) <= PER_SEGMENT);

/// The numbers of one of a pixel's segments.
#[derive(Clone, Copy)]
pub(crate) struct Segment {
    rng: Rng,
    first: u32,
}

impl Segment {
    /// Of that index.
    #[inline(always)]
    pub(crate) fn new(rng: &Rng, index: u32) -> Self {
        Self { rng: *rng, first: SEGMENTS + index * PER_SEGMENT }
    }

    /// Where it lies.
    #[inline(always)]
    pub(crate) fn words(&self) -> UVec4 {
        self.rng.draw(self.first)
    }

    /// Which of its points are taken.
    #[inline(always)]
    pub(crate) fn chances(&self) -> UVec4 {
        self.rng.hash(self.first + CHOICE)
    }

    /// The dimension of the light of a point; that of the direction from there follows.
    #[inline(always)]
    pub(crate) fn of_point(&self, index: u32) -> u32 {
        self.first + POINTS + 2 * index
    }

    /// The light of a point.
    #[inline(always)]
    pub(crate) fn light(&self, index: u32) -> UVec4 {
        self.rng.draw(self.of_point(index))
    }
}
