//! Renders an image with a technique on an executor.

pub use crate::exec::Progress;
use crate::exec::{Executor, Observer};
use crate::image::{Image, MAX_SIDE};
use crate::technique::{Repeats, Technique};
use crate::{Error, buffers::SceneBuffers, memory, scene::Camera};
use restir_shared::layout::FilmPixel;

/// What to render.
#[derive(Clone, Debug)]
pub struct Render {
    /// Image width in pixels, in 1..=[`MAX_SIDE`].
    pub width: u32,
    /// Image height in pixels, in 1..=[`MAX_SIDE`].
    pub height: u32,
    /// Samples a pixel or frames, as of [`crate::technique::About::repeats`]; not zero. The first frame has no history.
    pub count: u32,
    /// The image is the mean of all frames instead of the last one. The mean of samples is their image in any case.
    pub accumulate: bool,
    /// Seed of the random numbers.
    pub seed: u32,
    /// The camera of each frame, of which the last one stays; the scene's, which may move, if there is none.
    pub cameras: Vec<Camera>,
    /// The technique and its settings.
    pub technique: Box<dyn Technique>,
}

impl Render {
    /// One sample or frame, seen by the scene's camera.
    pub fn new([width, height]: [u32; 2], technique: impl Into<Box<dyn Technique>>) -> Self {
        let technique = technique.into();
        Self { width, height, count: 1, accumulate: false, seed: 0, cameras: Vec::new(), technique }
    }

    /// Whether the image is the mean of all samples or frames.
    pub fn is_mean(&self) -> bool {
        self.accumulate || self.technique.about().repeats == Repeats::Samples
    }

    /// The camera of a frame. Samples have one camera, that of the scene as it stands.
    pub fn camera(&self, scene: &SceneBuffers, frame: u32) -> Camera {
        let own = self.cameras.get(frame as usize).or(self.cameras.last()).copied();
        own.unwrap_or_else(|| match self.technique.about().repeats {
            Repeats::Samples => scene.camera,
            Repeats::Frames => scene.camera_at(f64::from(frame)),
        })
    }
}

/// A rendered image.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// Mean radiance.
    pub image: Image,
    /// How many dispatches it took.
    pub dispatches: u64,
    /// How many samples were dropped because they were not finite or the device cut them short.
    pub dropped_samples: u64,
}

/// Renders `scene`; `observe` sees each dispatch when it is done, and may end the render with an error.
///
/// # Errors
/// [`Error::Setting`] for settings out of range, [`Error::Memory`] if the buffers would take more than 80 % of the
/// memory, that of `observe`, and whatever the executor reports.
pub fn render(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    observe: &mut Observer<'_>,
) -> Result<Rendered, Error> {
    check(scene, render)?;
    let plan = render.technique.plan(scene, render);
    let dispatches = plan.pass_count;
    let words = executor.run(plan, observe)?;
    let pixels: &[FilmPixel] = words.first().map_or(&[], |words| bytemuck::cast_slice(words));
    Ok(Rendered {
        image: Image { width: render.width, height: render.height, pixels: pixels.iter().map(|p| p.sum).collect() },
        dispatches,
        dropped_samples: pixels.iter().map(|p| p.dropped as u64).sum(),
    })
}

/// Whether the settings are in range and the buffers fit: what [`render`] checks first.
///
/// # Errors
/// [`Error::Setting`] and [`Error::Memory`].
pub fn check(scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
    let (width, height, technique) = (render.width, render.height, &render.technique);
    let repeats = technique.about().repeats.name();
    let problem = if width == 0 || height == 0 {
        format!("an image of {width}x{height} pixels has no pixel; give both sides at least 1")
    } else if width > MAX_SIDE || height > MAX_SIDE {
        format!("an image of {width}x{height} pixels is too large; the longest side is {MAX_SIDE}")
    } else if render.count == 0 {
        format!("0 {repeats} make no image; give at least 1")
    } else {
        technique.check_ranges()?;
        technique.check(scene, render)?;
        return check_memory(scene, render);
    };
    Err(Error::Setting(problem))
}

fn check_memory(scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
    // beside the plan: the words read back, the image and its encoded form
    let copies = 3 * u64::from(render.width) * u64::from(render.height) * size_of::<FilmPixel>() as u64;
    // of a scene that moves: the frame in work and the last one
    let moves = scene.is_animated() && render.technique.about().repeats == Repeats::Frames;
    let frames = if moves { 2 * scene.stats().bytes } else { 0 };
    let bytes = render.technique.plan(scene, render).bytes() + copies + frames;
    memory::check(bytes, "this render", "choose a smaller size or settings that keep less")
}
