//! What a traversal has yet to visit: a restart trail, and a ring of the last far children (Laine 2010, "Restart Trail for Stackless BVH
//! Traversal"; Vaidyanathan, Woop and Benthin 2019, "Wide BVH Traversal with a Short Stack").
//!
//! A stack of all that may be pending takes [`TREE_DEPTH`] words, for which some compilers for GPUs use registers. The trail takes a bit a
//! level: whether all is visited there but what lies below. From it alone the way can be found again, from the root. The ring spares that, but
//! for where more far children are pending than it holds.

use super::ring::{Ring, SLOTS, Scratch};
use crate::layout::{NONE, TREE_DEPTH};

/// Nodes pending, and the way to the current one.
pub(super) struct Pending {
    /// Of the levels on the way, those below whose node nothing is pending but what the way leads to.
    settled: Levels,
    /// The levels above the current node.
    above: Levels,
    /// Far children that the ring was ever given, less those that were taken; the newest lies before this slot.
    top: u32,
    /// Those that it still holds.
    held: u32,
    ring: Ring,
}

impl Pending {
    /// Nothing pending, at the root.
    #[inline(always)]
    pub(super) fn new(scratch: Scratch) -> Self {
        Self { settled: Levels::NONE, above: Levels::NONE, top: 0, held: 0, ring: Ring::new(scratch) }
    }

    /// Which child of an inner node comes next, of those that a hit may lie in, the nearer first; [`NONE`] if there is none. The
    /// other one is pending.
    #[inline(always)]
    pub(super) fn descend(&mut self, near: u32, far: u32) -> u32 {
        let child = self.above.deeper();
        let level = child.less(self.above);
        self.above = child;
        // the way leads here a second time, after the nearer child; which is the nearer one does not change, and hits only become fewer
        let again = self.settled.meets(level);
        if (far != NONE) & !again {
            self.ring.exchange(self.top, far);
            self.top = self.top.wrapping_add(1);
            self.held = if self.held < SLOTS { self.held + 1 } else { self.held };
        } else {
            self.settled = self.settled.with(level);
        }
        if (far != NONE) & again { far } else { near }
    }

    /// The pending node that is deepest, or the `root`, from which the way leads to it; [`NONE`] if none is pending.
    #[inline(always)]
    pub(super) fn back(&mut self, root: u32) -> u32 {
        let open = self.above.less(self.settled);
        if open.is_empty() {
            return NONE;
        }
        let (level, way) = open.deepest();
        self.settled = self.settled.with(level).both(way);
        if self.held == 0 {
            self.above = Levels::NONE;
            return root;
        }
        self.above = way;
        self.held -= 1;
        self.top = self.top.wrapping_sub(1);
        self.ring.exchange(self.top, NONE)
    }
}

/// A set of the tree's levels: a bit each, the root's the highest. No target has to have integers of 64 bits.
#[derive(Clone, Copy)]
struct Levels {
    upper: u32,
    lower: u32,
}

const _: () = assert!(TREE_DEPTH == 64, "a bit a level");

impl Levels {
    const NONE: Self = Self { upper: 0, lower: 0 };

    /// Of the set of all levels above some level, that with this level.
    #[inline(always)]
    fn deeper(self) -> Self {
        Self { upper: (self.upper >> 1) | (1 << 31), lower: (self.lower >> 1) | (self.upper << 31) }
    }

    #[inline(always)]
    fn with(self, other: Self) -> Self {
        Self { upper: self.upper | other.upper, lower: self.lower | other.lower }
    }

    #[inline(always)]
    fn both(self, other: Self) -> Self {
        Self { upper: self.upper & other.upper, lower: self.lower & other.lower }
    }

    #[inline(always)]
    fn less(self, other: Self) -> Self {
        Self { upper: self.upper & !other.upper, lower: self.lower & !other.lower }
    }

    #[inline(always)]
    fn is_empty(self) -> bool {
        self.upper | self.lower == 0
    }

    #[inline(always)]
    fn meets(self, other: Self) -> bool {
        !self.both(other).is_empty()
    }

    /// Of a set that is not empty the deepest level, and the set of all levels down to it.
    #[inline(always)]
    fn deepest(self) -> (Self, Self) {
        if self.lower != 0 {
            let lower = lowest(self.lower);
            (Self { upper: 0, lower }, Self { upper: !0, lower: lower.wrapping_neg() })
        } else {
            let upper = lowest(self.upper);
            (Self { upper, lower: 0 }, Self { upper: upper.wrapping_neg(), lower: 0 })
        }
    }
}

/// The lowest bit.
#[inline(always)]
fn lowest(bits: u32) -> u32 {
    bits & bits.wrapping_neg()
}
