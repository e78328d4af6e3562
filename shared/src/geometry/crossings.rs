//! All places in which a segment meets one object.

use super::Hit;

/// Where a segment meets an object: how often, and the hits that come first.
///
/// It is a function of the set of hits, those with `0 < t < t_max` that count: no traversal shows in it. A hit is one of a triangle,
/// so a segment through an edge that two triangles share is reported by both; of sampled segments next to none is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossings {
    /// How many hits there are, also beyond those that are listed.
    pub count: u32,
    /// The hits of the smallest (t, id), in that order; [`Hit::MISS`] where there are fewer.
    pub nearest: [Hit; Self::LISTED],
}

impl Crossings {
    /// How many hits are listed.
    #[doc(hidden)]
    pub const LISTED: usize = 8;
    /// The object is not met.
    pub const NONE: Self = Self { count: 0, nearest: [Hit::MISS; Self::LISTED] };
    /// The device ended the search before its time, as [`Hit::CUT`] says it of a single hit.
    #[doc(hidden)]
    pub const CUT: Self = Self { count: u32::MAX, nearest: [Hit::MISS; Self::LISTED] };

    /// Whether this is [`Self::CUT`].
    #[doc(hidden)]
    #[inline(always)]
    pub fn is_cut(&self) -> bool {
        self.count == u32::MAX
    }

    /// One of the hits, each with the probability 1 / `count`, by `u` in [0, 1); [`Hit::MISS`] if there is none, and in the place of each
    /// that is not listed.
    #[doc(hidden)]
    #[inline(always)]
    pub fn one_of(&self, u: f32) -> Hit {
        let chosen = (u * self.count as f32) as usize;
        if chosen < Self::LISTED { self.nearest[chosen] } else { Hit::MISS }
    }

    /// With a hit more, of another triangle than those before.
    #[inline(always)]
    #[must_use]
    pub fn with(mut self, hit: Hit) -> Self {
        let mut carried = hit;
        let mut index = 0;
        while index < Self::LISTED {
            let listed = self.nearest[index];
            let first = (carried.t < listed.t) | ((carried.t == listed.t) & (carried.id < listed.id));
            self.nearest[index] = if first { carried } else { listed };
            carried = if first { listed } else { carried };
            index += 1;
        }
        self.count += 1;
        self
    }
}
