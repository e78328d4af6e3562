//! A scene in two frames over the same arenas.

use super::texture::component;
use super::{Frames, LightAddress, SceneView, Tracer};
use crate::layout::{FEATURES_ALL, NONE, SceneHeader};
use core::fmt;
use glam::UVec4;

/// A scene in two frames: two headers over the same arenas, which are the same header if nothing moves.
#[derive(Clone, Copy)]
pub struct SceneFrames<'a, const COMPILED: u32 = FEATURES_ALL> {
    /// The scene of this frame.
    pub this: SceneView<'a, COMPILED>,
    /// The tables of the other frame.
    pub other: SceneHeader,
    /// What answers visibility queries in the other frame.
    pub other_tracer: Tracer<'a>,
}

impl<const COMPILED: u32> fmt::Debug for SceneFrames<'_, COMPILED> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { this, other, .. } = self;
        f.debug_struct("SceneFrames").field("this", this).field("other", other).finish_non_exhaustive()
    }
}

#[cfg(not(target_arch = "spirv"))]
impl<'a> SceneFrames<'a> {
    /// The same frames for code that is compiled for some features only, if the scene has no others.
    #[doc(hidden)]
    #[inline(always)]
    pub fn within<const COMPILED: u32>(&self) -> Option<SceneFrames<'a, COMPILED>> {
        let Self { this, other, other_tracer } = *self;
        this.within().map(|this| SceneFrames { this, other, other_tracer })
    }
}

impl<'a, const COMPILED: u32> Frames for SceneFrames<'a, COMPILED> {
    type Scene = SceneView<'a, COMPILED>;

    #[inline(always)]
    fn scene(&self, other: bool) -> SceneView<'a, COMPILED> {
        SceneView {
            header: if other { self.other } else { self.this.header },
            tracer: if other { self.other_tracer } else { self.this.tracer },
            ..self.this
        }
    }

    #[inline(always)]
    fn counterpart(&self, address: LightAddress, of_other: bool) -> LightAddress {
        let base = if of_other { self.other.counterpart_base } else { self.this.header.counterpart_base };
        let mut light = address.light;
        if (base != NONE) & address.is_light() {
            let word: UVec4 = self.this.attribute(base.wrapping_add(light >> 2));
            light = component(word, light & 3);
        }
        LightAddress { light, ..address }
    }
}
