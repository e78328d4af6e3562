//! The last two frames of a render.

use restir_host::buffers::SceneBuffers;
use restir_host::exec::Executor;
use restir_host::image::Image;
use restir_host::render::{Images, Render, Shows};
use restir_host::technique::Repeats;

use crate::Error;

/// The last frame, and the one before if there are several with cameras of their own.
pub(super) struct Last {
    pub(super) image: Image,
    pub(super) before: Option<Image>,
}

impl Last {
    pub(super) fn of(render: &Render, scene: &SceneBuffers, executor: &mut dyn Executor) -> Result<Self, Error> {
        if render.cameras.len() < 2 || render.technique.about().repeats == Repeats::Samples {
            return Ok(Self { image: render.render(scene, executor)?.image, before: None });
        }
        let render = Render { shows: Shows::Each, ..render.clone() };
        let images = Images::new(scene, &render);
        let mut shown = [None, None];
        render.render_observed(scene, executor, &mut |step| {
            if images.is_finished(step) {
                let [_, last] = std::mem::take(&mut shown);
                shown = [last, Some(images.read(step)?.image)];
            }
            Ok(())
        })?;
        let [before, last] = shown;
        Ok(Self { image: last.unwrap_or_default(), before })
    }
}
