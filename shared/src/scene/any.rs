//! Scenes behind a pointer, of which kernels need to know no more than what they ask.

use crate::bsdf::Material;

use super::{AddressedLights, Frames, LightAddress, Probe, Surface, Trace};

/// A scene of any type: all that kernels may ask.
pub trait AnyScene: Trace + Surface<Material = Material> + AddressedLights {}

impl<S: Trace + Surface<Material = Material> + AddressedLights + ?Sized> AnyScene for S {}

/// A scene of any type that knows its objects.
pub trait AnyProbed: AnyScene + Probe {}

impl<S: AnyScene + Probe + ?Sized> AnyProbed for S {}

/// A scene of any type in two frames, see [`Frames`].
pub trait AnyFrames {
    /// The scene of this frame or, with `other`, of the other one.
    fn scene(&self, other: bool) -> &dyn AnyScene;

    /// The scene of this frame or, with `other`, of the other one, if it can be probed; it cannot, if not implemented. Kernels that probe are
    /// refused then.
    fn probed(&self, other: bool) -> Option<&dyn AnyProbed> {
        let _ = other;
        None
    }

    /// As [`Frames::counterpart`].
    fn counterpart(&self, address: LightAddress, of_other: bool) -> LightAddress;
}

impl<'a> Frames for &'a (dyn AnyFrames + 'a) {
    type Scene = &'a dyn AnyScene;

    fn scene(&self, other: bool) -> &'a dyn AnyScene {
        AnyFrames::scene(*self, other)
    }

    fn counterpart(&self, address: LightAddress, of_other: bool) -> LightAddress {
        AnyFrames::counterpart(*self, address, of_other)
    }
}

/// A scene of any type that knows its objects, in two frames.
#[derive(Clone, Copy)]
pub struct ProbedFrames<'a> {
    frames: &'a dyn AnyFrames,
    scenes: [&'a dyn AnyProbed; 2],
}

impl<'a> ProbedFrames<'a> {
    /// These frames, if they can be probed.
    pub fn new(frames: &'a dyn AnyFrames) -> Option<Self> {
        Some(Self { frames, scenes: [frames.probed(false)?, frames.probed(true)?] })
    }
}

impl<'a> Frames for ProbedFrames<'a> {
    type Scene = &'a dyn AnyProbed;

    fn scene(&self, other: bool) -> &'a dyn AnyProbed {
        self.scenes[usize::from(other)]
    }

    fn counterpart(&self, address: LightAddress, of_other: bool) -> LightAddress {
        self.frames.counterpart(address, of_other)
    }
}

impl core::fmt::Debug for ProbedFrames<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("ProbedFrames").finish_non_exhaustive()
    }
}
