//! The last two frames of a render.

use std::sync::Arc;

use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::image::Image;
use restir_host::render::{Images, Render, Shows};
use restir_host::session::{CpuSession, Setup, View};
use restir_host::settings::More;

use crate::Error;

/// The last frame, and the one before if there are several with cameras of their own.
#[derive(Default)]
pub(super) struct Last {
    pub(super) image: Image,
    pub(super) before: Option<Image>,
}

impl Last {
    pub(super) fn of(render: &Render, scene: &SceneBuffers, executor: &mut dyn Executor) -> Result<Self, Error> {
        if render.cameras.len() < 2 {
            return Ok(Self { image: render.render(scene, executor)?.image, before: None });
        }
        let render = Render { shows: Shows::Each, ..render.clone() };
        let images = Images::new(scene, &render);
        let mut last = Self::default();
        render.render_observed(scene, executor, &mut |step| {
            if images.is_finished(step) {
                last.follow(images.read(step)?.image);
            }
            Ok(())
        })?;
        Ok(last)
    }

    /// Of a technique that takes samples: a session shows so many of them a frame, of each frame those of its own.
    pub(super) fn of_samples(render: &Render, samples: u32, scene: &Arc<SceneBuffers>) -> Result<Self, Error> {
        let Render { width, height, seed, technique, denoise, cameras, .. } = render;
        let setup = Setup {
            scene: scene.clone(),
            technique: technique.clone(),
            size: [*width, *height],
            seed: *seed,
            samples,
            mean_of: None,
            denoise: denoise.clone(),
            surfaces_given: false,
            _more: More::default(),
        };
        let mut session = CpuSession::new(setup, CpuExecutor::new()?)?;
        let mut last = Self::default();
        for camera in cameras {
            session.frame(&View { camera: Some(*camera), ..View::default() })?;
            last.follow(session.image());
        }
        Ok(last)
    }

    fn follow(&mut self, image: Image) {
        let before = std::mem::replace(&mut self.image, image);
        self.before = (!before.pixels.is_empty()).then_some(before);
    }
}
