//! What becomes of a sample that is shifted, and why nothing does.

use glam::Vec3;

/// A sample where it was shifted to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shifted {
    /// The integrand there, linear RGB; black if there is no such sample.
    pub value: Vec3,
    /// Its partial Jacobian there; 0 if there is no such sample.
    pub term: f32,
    /// Why there is none.
    pub cause: Cause,
}

/// Why a shift gives no sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u32)]
pub enum Cause {
    /// The shift gives a sample: nothing stands against it.
    Nothing,
    /// There is none, or one that no shift takes anywhere, or it would have to be replayed too far.
    Unshiftable,
    /// What was replayed could be joined elsewhere, or cannot be joined here.
    Joins,
    /// Replay ends too early: in the void, at what does not emit, or where light is absorbed.
    Replay,
    /// What is to be joined sends nothing this way: it turns its back, or a lobe is missing.
    Dark,
    /// Something lies between.
    Blocked,
    /// A number is out of range, or the device cut a loop short.
    Broken,
}

impl Cause {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 7] =
        [Self::Nothing, Self::Unshiftable, Self::Joins, Self::Replay, Self::Dark, Self::Blocked, Self::Broken];
}

impl Shifted {
    /// No sample.
    pub(crate) const fn failed(cause: Cause) -> Self {
        Self { value: Vec3::ZERO, term: 0.0, cause }
    }
}
