//! A scene in two frames, each in arenas of its own.

use crate::buffers::SceneBuffers;
use restir_shared::scene::{Frames, LightAddress, SceneView};
use std::fmt;
use std::sync::Arc;

/// A scene in this frame and in the last one: what [`restir_shared::scene::SceneFrames`] is over the arenas of a plan.
pub(crate) struct TwoFrames {
    scenes: [Arc<SceneBuffers>; 2],
    /// Those that kernels may have.
    features: u32,
    /// For each light of either frame its index in the other one, if not all are the same.
    counterparts: [Option<Arc<[u32]>>; 2],
}

impl fmt::Debug for TwoFrames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TwoFrames").field("features", &self.features).finish_non_exhaustive()
    }
}

impl TwoFrames {
    pub(crate) fn new([this, last]: [Arc<SceneBuffers>; 2], features: u32) -> Self {
        Self { counterparts: [this.counterparts(&last), last.counterparts(&this)], scenes: [this, last], features }
    }

    /// A scene that stands still.
    pub(crate) fn still(scene: &SceneBuffers, features: u32) -> Self {
        // so that the copy has it as well
        scene.tracer();
        let scene = Arc::new(scene.clone());
        Self { scenes: [scene.clone(), scene], features, counterparts: [None, None] }
    }

    pub(crate) fn this(&self) -> &SceneBuffers {
        &self.scenes[0]
    }
}

impl<'a> Frames for &'a TwoFrames {
    type Scene = SceneView<'a>;

    fn scene(&self, other: bool) -> SceneView<'a> {
        SceneView { features: self.features, ..self.scenes[usize::from(other)].traced_view() }
    }

    fn counterpart(&self, address: LightAddress, of_other: bool) -> LightAddress {
        match &self.counterparts[usize::from(of_other)] {
            Some(lights) if address.is_light() => LightAddress { light: lights[address.light as usize], ..address },
            _ => address,
        }
    }
}
