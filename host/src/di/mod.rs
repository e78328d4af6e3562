//! Direct light by ReSTIR: frames that reuse each other's reservoirs.

mod moments;
pub(crate) mod plan;
mod settings;
mod shading;

pub use plan::plan;
pub use settings::{
    DiSettings, MAX_CANDIDATES, MAX_CONFIDENCE_CAP, MAX_NEIGHBOURS, MAX_SHADED, MAX_SPATIAL_PASSES, MAX_TILE_SIZE,
    MAX_TILES, MisForm, Target, Visibility,
};

use crate::buffers::SceneBuffers;
use crate::exec::{Executor, Step};
use crate::image::Image;
use crate::render::{MAX_SIDE, Progress, Rendered};
use crate::scene::Camera;
use crate::{Error, memory};
use restir_shared::layout::FilmPixel;
use restir_shared::scene::LightAddress;
use std::ops::ControlFlow;

/// What to render.
#[derive(Clone, Debug, PartialEq)]
pub struct DiRender {
    /// Image width in pixels, in 1..=[`MAX_SIDE`].
    pub width: u32,
    /// Image height in pixels, in 1..=[`MAX_SIDE`].
    pub height: u32,
    /// Frames, not zero. The first has no history.
    pub frames: u32,
    /// The image is the mean of all frames instead of the last one.
    pub accumulate: bool,
    /// Seed of the random numbers.
    pub seed: u32,
    /// The camera of each frame, of which the last one stays; the scene's if there is none.
    pub cameras: Vec<Camera>,
    /// Settings of the technique.
    pub settings: DiSettings,
}

impl DiRender {
    /// One frame of the scene's camera.
    pub fn new([width, height]: [u32; 2], settings: DiSettings) -> Self {
        Self { width, height, frames: 1, accumulate: false, seed: 0, cameras: Vec::new(), settings }
    }

    /// Samples that the film holds.
    fn film_samples(&self) -> u64 {
        u64::from(if self.accumulate { self.frames } else { 1 }) * u64::from(self.settings.shading_passes())
    }

    fn camera(&self, scene: &SceneBuffers, frame: u32) -> Camera {
        self.cameras.get(frame as usize).or(self.cameras.last()).copied().unwrap_or(scene.camera)
    }
}

/// Renders frames of `scene`, of one with an animation frame f at time f; `observe` is called after each dispatch and may stop the render.
///
/// # Errors
/// As [`crate::render::render`].
pub fn render(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &DiRender,
    observe: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Rendered, Error> {
    render_shown(executor, scene, render, &mut |_| Ok(()), observe)
}

/// As [`render`]; `show` is given each pass when it is done, and may end the work with an error.
pub(crate) fn render_shown(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &DiRender,
    show: &mut dyn FnMut(&Step<'_>) -> Result<(), Error>,
    observe: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Rendered, Error> {
    check(scene, render)?;
    let plan = plan(scene, render);
    let total = plan.pass_count;
    let mut shown = Ok(());
    let run = executor.run(plan, &mut |step| {
        shown = show(step);
        if shown.is_ok() { observe(Progress { done: step.done, total }) } else { ControlFlow::Break(()) }
    });
    shown?;
    let words = run?;
    let pixels: &[FilmPixel] = words.first().map_or(&[], |words| bytemuck::cast_slice(words));
    Ok(Rendered {
        image: Image { width: render.width, height: render.height, pixels: pixels.iter().map(|p| p.sum).collect() },
        dispatches: total,
        dropped_samples: pixels.iter().map(|p| p.dropped as u64).sum(),
    })
}

/// Whether the settings are in range and the buffers fit: what [`render`] checks first.
///
/// # Errors
/// [`Error::Setting`] and [`Error::Memory`].
pub fn check(scene: &SceneBuffers, render: &DiRender) -> Result<(), Error> {
    render.settings.check()?;
    let (width, height) = (render.width, render.height);
    let problem = if width == 0 || height == 0 {
        Some(format!("an image of {width}x{height} pixels has no pixel; give both sides at least 1"))
    } else if width > MAX_SIDE || height > MAX_SIDE {
        Some(format!("an image of {width}x{height} pixels is too large; the longest side is {MAX_SIDE}"))
    } else if render.frames == 0 {
        Some("0 frames make no image; give at least 1".to_owned())
    } else if render.film_samples() > u64::from(u32::MAX) {
        Some(format!(
            "{} frames of {} passes of shading are too many; give fewer frames, or a smaller setting shaded",
            render.frames,
            render.settings.shading_passes()
        ))
    } else if scene.most_lights() >= LightAddress::NO_LIGHT {
        Some(format!(
            "the scene has {} lights and reservoirs know at most {}; use --technique path",
            scene.most_lights(),
            LightAddress::NO_LIGHT - 1
        ))
    } else {
        None
    };
    problem.map_or(Ok(()), |problem| Err(Error::Setting(problem)))?;
    // beside the plan: the words read back, the image and its encoded form
    let copies = 3 * u64::from(width) * u64::from(height) * size_of::<FilmPixel>() as u64;
    // of a scene that moves: the frame in work and the last one
    let frames = if scene.is_animated() { 2 * scene.stats().bytes } else { 0 };
    memory::check(
        plan(scene, render).bytes() + copies + frames,
        "this render",
        "choose a smaller size, fewer tiles, or shaded=0",
    )
}
