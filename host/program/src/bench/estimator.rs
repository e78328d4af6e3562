//! What a benchmark can measure: a technique with its settings.

use std::ops::ControlFlow;

use restir::Error;
use restir::buffers::SceneBuffers;
use restir::di::{self, DiRender};
use restir::exec::Executor;
use restir::render::{self, Progress, RenderSettings, Rendered};
use restir::replay::{self, Counts, Recording};
use restir_shared::technique::di::DiParams;

/// Rays are counted over about this many pixels ...
const COUNTED_PIXELS: u32 = 2048;
/// ... and this many samples of each.
const COUNTED_SAMPLES: u32 = 4;
/// Frames of ReSTIR DI that are others than the later ones: the first has no history, and both find hits for their plane.
const SETTLING_FRAMES: u32 = 2;

/// A technique with its settings; samples and seed do not matter. A frame of ReSTIR DI is a sample.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Estimator {
    Path(RenderSettings),
    RestirDi(DiRender),
}

impl Estimator {
    /// One image of so many samples a pixel.
    ///
    /// # Errors
    /// As of [`render::render`].
    pub(crate) fn render(
        &self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        [samples, seed]: [u32; 2],
        observe: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Rendered, Error> {
        match self {
            Self::Path(settings) => {
                render::render(executor, scene, &RenderSettings { samples, seed, ..settings.clone() }, observe)
            }
            Self::RestirDi(render) => {
                di::render(executor, scene, &DiRender { frames: samples, seed, ..render.clone() }, observe)
            }
        }
    }

    /// Whether the settings are in range and the buffers fit.
    ///
    /// # Errors
    /// As of [`render::check`].
    pub(crate) fn check(&self, scene: &SceneBuffers) -> Result<(), Error> {
        match self {
            Self::Path(settings) => render::check(scene, settings),
            Self::RestirDi(render) => di::check(scene, render),
        }
    }

    /// Whether samples depend on each other.
    pub(crate) fn reuses(&self) -> bool {
        matches!(self, Self::RestirDi(render) if render.settings.reuses())
    }

    /// Whether the image is the mean of all samples.
    pub(crate) fn accumulates(&self) -> bool {
        match self {
            Self::Path(_) => true,
            Self::RestirDi(render) => render.accumulate,
        }
    }

    /// Rays and evaluations, and the samples over which they were counted, natively: what is measured is not burdened.
    ///
    /// # Errors
    /// As of [`Self::check`].
    pub(crate) fn counts(&self, scene: &SceneBuffers) -> Result<(Counts, u64), Error> {
        match self {
            Self::Path(settings) => path_counts(scene, settings),
            Self::RestirDi(render) => {
                self.check(scene)?;
                di_counts(scene, render)
            }
        }
    }
}

fn path_counts(scene: &SceneBuffers, settings: &RenderSettings) -> Result<(Counts, u64), Error> {
    let view = scene.view();
    let (width, height) = (settings.width, settings.height);
    let stride = (width * height).div_ceil(COUNTED_PIXELS) | 1;
    let (mut counts, mut counted) = (Counts::default(), 0);
    for index in 0..COUNTED_SAMPLES {
        let params = replay::params(scene, settings, index)?;
        for pixel in (0..width * height).step_by(stride as usize) {
            let recording = Recording::new(&view);
            replay::trace(&recording, &params, pixel % width, pixel / width);
            counts = counts.plus(recording.counts());
            counted += 1;
        }
    }
    Ok((counts, counted))
}

/// A few frames of a smaller image, after [`SETTLING_FRAMES`]. What fills tiles is shared by all pixels of the image itself.
fn di_counts(scene: &SceneBuffers, render: &DiRender) -> Result<(Counts, u64), Error> {
    let pixels = u64::from(render.width) * u64::from(render.height);
    let shrink = (f64::from(COUNTED_PIXELS) / pixels as f64).sqrt().min(1.0);
    let side = |side: u32| ((f64::from(side) * shrink) as u32).max(1);
    let frames = SETTLING_FRAMES + COUNTED_SAMPLES;
    let smaller =
        DiRender { width: side(render.width), height: side(render.height), frames, accumulate: true, ..render.clone() };
    let view = scene.view();
    let recording = Recording::new(&view);
    let mut counts = Counts::default();
    replay::run(&recording, di::plan(scene, &smaller), &mut |step| {
        let of_pass = recording.take_counts();
        if step.pass.params::<DiParams>().is_some_and(|p| p.frame >= SETTLING_FRAMES) {
            counts = counts.plus(of_pass);
        }
        Ok(())
    })?;
    let counted = u64::from(smaller.width) * u64::from(smaller.height) * u64::from(COUNTED_SAMPLES);
    let presampled = u64::from(render.settings.tiles) * u64::from(render.settings.tile_size);
    let share = presampled as f64 / pixels as f64;
    Ok((Counts { light_samples: counts.light_samples + (share * counted as f64) as u64, ..counts }, counted))
}
