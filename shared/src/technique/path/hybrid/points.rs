//! The points at which the segments of a profile meet a body.

use super::profile::EntryProfile;
use super::segment::Segment;
use crate::diffusion::DiskNumbers;
use crate::geometry::{Crossings, Hit, Ray};
use crate::num;
use crate::pack::floor_24;
use crate::rng::{self, Rng};
use crate::scene::{Probe, Surface};

/// Stands for the entry among the points of a segment: there channels are Lambertian.
pub(crate) const ENTRY: u32 = Crossings::LISTED as u32;

/// Yields the points of all segments, one after the other, and after those of a segment the entry itself. Its caller has one loop, not one
/// over segments and one over points in it: a compiler keeps the state of both in registers.
pub(crate) struct Points {
    segments: u32,
    /// One point of each segment counts.
    one: bool,
    segment: u32,
    /// The next point of the segment.
    turn: u32,
    numbers: DiskNumbers,
    crossings: Crossings,
}

/// A point.
#[derive(Clone, Copy)]
pub(crate) struct Found {
    /// Where it is; a miss if the segment has no such point.
    pub(crate) hit: Hit,
    /// The index of the segment.
    pub(crate) segment: u32,
    /// Which of the segment's hits it is, from 0; or [`ENTRY`].
    pub(crate) crossing: u32,
    /// By this index, from 0 to [`ENTRY`], the point has random numbers of its own.
    pub(crate) turn: u32,
    /// What the point is worth over its density is multiplied by this: one over the segments, times the points among which it was chosen.
    pub(crate) each: f32,
    /// The random numbers that made the segment.
    pub(crate) numbers: DiskNumbers,
}

impl Points {
    /// Begins with the first of so many segments; with `one`, a single point of each counts.
    #[inline(always)]
    pub(crate) fn new(segments: u32, one: bool) -> Self {
        Self { segments, one, segment: 0, turn: 0, numbers: DiskNumbers::NONE, crossings: Crossings::NONE }
    }

    /// Whether a point is to come.
    #[inline(always)]
    pub(crate) fn go_on(&self) -> bool {
        (self.segment < self.segments) & !self.is_cut()
    }

    /// Whether the device ended a search before its time, so that none of the points counts.
    #[inline(always)]
    pub(crate) fn is_cut(&self) -> bool {
        self.crossings.is_cut()
    }

    /// The next point of the profile around the hit `entry` of a body.
    #[inline(always)]
    pub(crate) fn next<S: Probe + Surface>(
        &mut self,
        scene: &S,
        rng: &Rng,
        profile: &EntryProfile,
        (entry, body): (&Hit, u32),
    ) -> Found {
        let (segment, turn) = (self.segment, self.turn);
        let per_segment = num::recip(self.segments as f32);
        if turn == 0 {
            let words = Segment::new(rng, segment).words();
            self.numbers = profile.numbers(words, segment, per_segment);
            let key = segment_key(&self.numbers, scene.features());
            self.crossings = scene.probe(&Ray { key, ..profile.disk.segment(&self.numbers) }, body);
        }
        let count = self.crossings.count;
        let is_entry = turn == ENTRY;
        let chosen =
            if self.one { self.crossings.one_of(rng::unit(Segment::new(rng, segment).chances().x)) } else { turn };
        let crossing = if is_entry { ENTRY } else { chosen };
        let hit = if is_entry { *entry } else { self.crossings.listed(crossing as usize) };
        // what is not listed has no turn
        let next = if self.one | (turn + 1 >= count) | (turn + 1 >= ENTRY) { ENTRY } else { turn + 1 };
        self.turn = if is_entry { 0 } else { next };
        self.segment = if is_entry { segment + 1 } else { segment };
        let each = per_segment * if self.one & !is_entry { count as f32 } else { 1.0 };
        Found { hit, segment, crossing, turn, each, numbers: self.numbers }
    }
}

/// The key of the segment of these numbers, in a scene of these features: a function of what a reservoir keeps, so that replay meets what was
/// met.
#[inline(always)]
pub(crate) fn segment_key(numbers: &DiskNumbers, features: u32) -> u32 {
    Ray::random_key(features, floor_24(numbers.radius) ^ (floor_24(numbers.turn) << 8))
}
