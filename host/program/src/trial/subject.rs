//! What trials show.

use super::Window;
use restir::render::Render;
use restir::scene::{Camera, Scene};
use restir::{Error, buffers::SceneBuffers};

/// What is seen over some frames.
#[derive(Debug)]
pub struct Subject {
    buffers: SceneBuffers,
    /// As it is in the last frame, if it moves.
    last: Option<SceneBuffers>,
    /// Of each frame; the last one stays.
    cameras: Vec<Camera>,
}

/// A render to be tried, in windows.
#[derive(Clone, Debug)]
pub struct Trial<'a> {
    /// What is rendered.
    pub scene: &'a SceneBuffers,
    /// The windows and the renders through them; their seeds do not matter.
    pub pieces: Vec<(Window, Render)>,
}

impl Subject {
    /// So many frames of a scene with its buffers, seen by `cameras`, or by the scene's if there are none.
    ///
    /// # Errors
    /// As of [`SceneBuffers::build`].
    pub fn new(scene: &Scene, buffers: SceneBuffers, cameras: Vec<Camera>, frames: u32) -> Result<Self, Error> {
        let at_the_end = || SceneBuffers::build(&scene.at(f64::from(frames.saturating_sub(1))));
        let last = buffers.is_animated().then(at_the_end).transpose()?;
        let of_scene = |frame: u32| buffers.camera_at(f64::from(frame));
        let cameras = if cameras.is_empty() { (0..frames).map(of_scene).collect() } else { cameras };
        Ok(Self { buffers, last, cameras })
    }

    /// A trial of a render that shows the last frame, or of one that is a mean of samples or frames: then what is there in
    /// the last frame stands still, so that all trials have the same truth.
    pub fn trial(&self, render: &Render, windows: &[Window]) -> Trial<'_> {
        let (scene, cameras) = match render.is_mean() {
            false => (&self.buffers, self.cameras.clone()),
            true => (self.last.as_ref().unwrap_or(&self.buffers), self.cameras.last().copied().into_iter().collect()),
        };
        let whole = Render { cameras, ..render.clone() };
        Trial { scene, pieces: windows.iter().map(|window| (*window, window.of(&whole))).collect() }
    }
}
