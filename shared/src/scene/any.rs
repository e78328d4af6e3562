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

    /// The scene of this frame, if it can be probed; it cannot, if not implemented. Kernels that probe are refused then.
    fn probed(&self) -> Option<&dyn AnyProbed> {
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
