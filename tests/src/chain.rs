//! Chains of frames whose last one is compared with what it should be in the mean.

use crate::scenes;
use glam::DVec3;
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::Camera;

/// How far the camera moves from frame to frame.
const STEP: DVec3 = DVec3::new(0.03, 0.0, 0.0);

/// Frames of a technique.
#[derive(Clone, Copy, Debug)]
pub struct Chain {
    /// The scene's name.
    pub scene: &'static str,
    /// Settings of the technique, joined by commas.
    pub settings: &'static str,
    /// How many frames.
    pub frames: u32,
    /// The camera moves.
    pub moves: bool,
}

impl Chain {
    /// See the fields.
    pub const fn new(scene: &'static str, settings: &'static str, frames: u32, moves: bool) -> Self {
        Self { scene, settings, frames, moves }
    }

    /// For messages.
    pub fn title(&self) -> String {
        let Self { scene, settings, frames, moves } = self;
        format!("{scene}, {settings}, {frames} frames, moves: {moves}")
    }

    /// The scene.
    ///
    /// # Errors
    /// As of [`scenes::buffers`].
    pub fn buffers(&self) -> Result<SceneBuffers, Error> {
        scenes::buffers(self.scene)
    }

    /// The camera of each frame; none if it is the scene's.
    pub fn cameras(&self, scene: &SceneBuffers) -> Vec<Camera> {
        let camera = |frame| Camera { position: scene.camera.position + STEP * f64::from(frame), ..scene.camera };
        if self.moves { (0..self.frames).map(camera).collect() } else { Vec::new() }
    }
}
