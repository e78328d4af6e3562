//! All places in which a segment meets one object.

use super::Hit;
use super::ring::Scratch;
#[cfg(target_arch = "spirv")]
use super::workgroup;
#[cfg(target_arch = "spirv")]
use glam::Vec2;

/// Where a segment meets an object: how often, and the hits that come first.
///
/// It is a function of the set of hits, those with `0 < t < t_max` that count: no traversal shows in it. A hit is one of a triangle,
/// so a segment through an edge that two triangles share is reported by both; of sampled segments next to none is one.
///
/// On a device the hits lie in memory of the workgroup, so that they take no registers. There the next probe of an invocation takes the memory
/// of the last one, whose crossings are gone then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossings {
    /// How many hits there are, also beyond those that are listed.
    pub count: u32,
    /// The hits of the smallest (t, id), in that order; [`Hit::MISS`] where there are fewer.
    #[cfg(not(target_arch = "spirv"))]
    pub nearest: [Hit; Self::LISTED],
    #[cfg(target_arch = "spirv")]
    memory: Scratch,
}

impl Crossings {
    /// How many hits are listed.
    #[doc(hidden)]
    pub const LISTED: usize = 8;

    /// Whether the device ended the search before its time, as [`Hit::CUT`] says it of a single hit.
    #[doc(hidden)]
    #[inline(always)]
    pub fn is_cut(&self) -> bool {
        self.count == u32::MAX
    }

    /// How many hits the list holds.
    #[inline(always)]
    fn held(&self) -> usize {
        if self.is_cut() {
            0
        } else if self.count < Self::LISTED as u32 {
            self.count as usize
        } else {
            Self::LISTED
        }
    }

    /// The place of one of the hits, each with the probability 1 / `count`, by `u` in [0, 1). It may be one that is not listed.
    #[doc(hidden)]
    #[inline(always)]
    pub fn one_of(&self, u: f32) -> u32 {
        (u * self.count as f32) as u32
    }

    /// With a hit more, of another triangle than those before.
    #[inline(always)]
    #[must_use]
    pub fn with(mut self, hit: Hit) -> Self {
        let held = self.held();
        let mut carried = hit;
        let mut index = 0;
        while index < held {
            let listed = self.listed(index);
            if (carried.t < listed.t) | ((carried.t == listed.t) & (carried.id < listed.id)) {
                self.list(index, &carried);
                carried = listed;
            }
            index += 1;
        }
        if held < Self::LISTED {
            self.list(held, &carried);
        }
        self.count += 1;
        self
    }
}

#[cfg(not(target_arch = "spirv"))]
impl Crossings {
    /// The object is not met.
    pub const NONE: Self = Self { count: 0, nearest: [Hit::MISS; Self::LISTED] };
    /// The device ended the search before its time.
    #[doc(hidden)]
    pub const CUT: Self = Self { count: u32::MAX, nearest: [Hit::MISS; Self::LISTED] };

    /// A list without hits. Natively it holds its hits itself.
    #[inline(always)]
    pub(super) fn none(_memory: Scratch) -> Self {
        Self::NONE
    }

    /// The same, ended before its time.
    #[inline(always)]
    pub(super) fn cut(self) -> Self {
        Self::CUT
    }

    /// The hit at a place of the list; [`Hit::MISS`] beyond its end.
    #[doc(hidden)]
    #[inline(always)]
    pub fn listed(&self, index: usize) -> Hit {
        if index < Self::LISTED { self.nearest[index] } else { Hit::MISS }
    }

    #[inline(always)]
    fn list(&mut self, index: usize, hit: &Hit) {
        self.nearest[index] = *hit;
    }
}

#[cfg(target_arch = "spirv")]
impl Crossings {
    /// The object is not met.
    pub const NONE: Self = Self { count: 0, memory: Scratch { invocation: 0 } };

    #[inline(always)]
    pub(super) fn none(memory: Scratch) -> Self {
        Self { count: 0, memory }
    }

    #[inline(always)]
    pub(super) fn cut(self) -> Self {
        Self { count: u32::MAX, ..self }
    }

    /// The hit at a place of the list; [`Hit::MISS`] beyond its end.
    #[doc(hidden)]
    #[inline(always)]
    pub fn listed(&self, index: usize) -> Hit {
        if index >= self.held() {
            return Hit::MISS;
        }
        let word = |component: u32| self.access(index, component, 0, false);
        Hit { t: f32::from_bits(word(0)), id: word(1), uv: Vec2::new(f32::from_bits(word(2)), f32::from_bits(word(3))) }
    }

    #[inline(always)]
    fn list(&mut self, index: usize, hit: &Hit) {
        self.access(index, 0, hit.t.to_bits(), true);
        self.access(index, 1, hit.id, true);
        self.access(index, 2, hit.uv.x.to_bits(), true);
        self.access(index, 3, hit.uv.y.to_bits(), true);
    }

    /// Reads a word of the hit at a place of the list; if it `writes`, it puts another one there.
    #[inline(always)]
    fn access(&self, index: usize, component: u32, word: u32, writes: bool) -> u32 {
        const WORDS: usize = Crossings::LISTED * 4 * Scratch::INVOCATIONS as usize;
        workgroup::access::<WORDS>(self.memory.invocation, index as u32 * 4 + component, word, writes)
    }
}
