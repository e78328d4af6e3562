//! What a pass of path tracing does.

use bytemuck::{Pod, Zeroable};
use core::ops::BitOr;

/// What a pass of path tracing does: a set of flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct PathFlags(u32);

crate::fields!(PathFlags);

impl PathFlags {
    /// None of them.
    pub const NONE: Self = Self(0);
    /// Samples are spread uniformly over the pixel instead of going through its centre.
    pub const JITTER: Self = Self(1);
    /// Russian roulette on the throughput from the fourth segment on.
    pub const ROULETTE: Self = Self(1 << 1);
    /// Samples are spread about the pixel with the density of the Blackman-Harris filter.
    pub const BLACKMAN_HARRIS: Self = Self(1 << 2);
    /// Numbers are drawn by [`Sampler::Sobol`](crate::rng::Sampler::Sobol).
    pub const SOBOL: Self = Self(1 << 3);
}

// of the kernels of `hybrid`
#[doc(hidden)]
impl PathFlags {
    /// What does not enter an interior that scatters counts.
    pub const REST: Self = Self(1 << 8);
    /// The boundary term counts.
    pub const BOUNDARY: Self = Self(1 << 9);
    /// Single scattering counts.
    pub const SINGLE: Self = Self(1 << 10);
    /// The profile counts.
    pub const PROFILE: Self = Self(1 << 11);
    /// The profile keeps what has scattered once.
    pub const WHOLE: Self = Self(1 << 12);
    /// [`Remainder::Signed`](crate::diffusion::Remainder::Signed).
    pub const SIGNED: Self = Self(1 << 13);
    /// [`Remainder::Clamped`](crate::diffusion::Remainder::Clamped).
    pub const CLAMPED: Self = Self(1 << 14);
    /// [`WayOut::Drawn`](crate::transport::WayOut::Drawn).
    pub const DRAWN: Self = Self(1 << 15);
    /// Of the points that a segment meets one is taken, not all.
    pub const ONE_CROSSING: Self = Self(1 << 16);
    /// The channel of a radius is chosen in proportion to the albedo, not uniformly.
    pub const BY_ALBEDO: Self = Self(1 << 17);
    /// [`Support::Published`](crate::diffusion::Support::Published).
    pub const PUBLISHED: Self = Self(1 << 18);
    /// From one of the points of the profile the path goes on.
    pub const GOES_ON: Self = Self(1 << 19);
    /// Of what enters no body, that counts which the first surface reflects or lets through by diffuse lobes; and what shines itself.
    pub const DIFFUSE: Self = Self(1 << 20);
    /// The same of specular lobes.
    pub const SPECULAR: Self = Self(1 << 21);
    /// The profile, without what has scattered once, depends on how thick the body is ([`Thickness`](crate::diffusion::Thickness)).
    pub const THICKNESS: Self = Self(1 << 22);
}

impl PathFlags {
    /// Whether any of these flags is set.
    #[inline(always)]
    pub fn contains(self, flags: Self) -> bool {
        self.0 & flags.0 != 0
    }

    /// These flags, or none.
    #[must_use]
    pub const fn only_if(self, holds: bool) -> Self {
        if holds { self } else { Self::NONE }
    }

    /// The flags that have their bit in a word to which a kernel is specialised.
    #[inline(always)]
    #[must_use]
    #[doc(hidden)]
    pub const fn specialised(self, bits: u32) -> Self {
        Self(self.0 & bits)
    }

    /// The word, to which a kernel is specialised.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// The flag of a stage of `hybrid`: whether what it finds counts.
    #[inline(always)]
    pub(super) fn of_stage(stage: u32) -> Self {
        Self(Self::REST.0 << stage)
    }
}

impl BitOr for PathFlags {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
