//! A scene that stands still, for code that asks for two frames.

use super::{AddressedLights, Frames, LightAddress, Surface, Trace};
#[cfg(not(target_arch = "spirv"))]
use super::{AnyFrames, AnyProbed, AnyScene};

/// A scene that was the same in any other frame.
#[derive(Clone, Copy, Debug)]
pub struct Still<S>(pub S);

impl<S: Trace + Surface + AddressedLights + Copy> Frames for Still<S> {
    type Scene = S;

    #[inline(always)]
    fn scene(&self, _other: bool) -> S {
        self.0
    }

    #[inline(always)]
    fn counterpart(&self, address: LightAddress, _of_other: bool) -> LightAddress {
        address
    }
}

#[cfg(not(target_arch = "spirv"))]
impl<S: AnyScene> AnyFrames for Still<S> {
    fn scene(&self, _other: bool) -> &dyn AnyScene {
        &self.0
    }

    fn counterpart(&self, address: LightAddress, _of_other: bool) -> LightAddress {
        address
    }
}

/// A scene that knows its objects and was the same in any other frame.
#[cfg(not(target_arch = "spirv"))]
#[derive(Clone, Copy, Debug)]
pub struct Probed<S>(pub S);

#[cfg(not(target_arch = "spirv"))]
impl<S: AnyProbed> AnyFrames for Probed<S> {
    fn scene(&self, _other: bool) -> &dyn AnyScene {
        &self.0
    }

    fn probed(&self, _other: bool) -> Option<&dyn AnyProbed> {
        Some(&self.0)
    }

    fn counterpart(&self, address: LightAddress, _of_other: bool) -> LightAddress {
        address
    }
}

/// A scene in this frame and in the other one, with the same lights: each keeps its index and its points.
impl<S: Trace + Surface + AddressedLights + Copy> Frames for [S; 2] {
    type Scene = S;

    #[inline(always)]
    fn scene(&self, other: bool) -> S {
        self[other as usize]
    }

    #[inline(always)]
    fn counterpart(&self, address: LightAddress, _of_other: bool) -> LightAddress {
        address
    }
}

#[cfg(not(target_arch = "spirv"))]
impl<S: AnyScene> AnyFrames for [S; 2] {
    fn scene(&self, other: bool) -> &dyn AnyScene {
        &self[usize::from(other)]
    }

    fn counterpart(&self, address: LightAddress, _of_other: bool) -> LightAddress {
        address
    }
}
