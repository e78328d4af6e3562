//! Renders of an image, or of a sequence of them, with a technique on an executor.
//!
//! ```
//! use restir_host::render::{Images, Render, Shows};
//! use restir_host::technique::restir_di::DiSettings;
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 3, shows: Shows::Each, ..Render::new([16, 16], DiSettings::default()) };
//! let (images, mut shown) = (Images::new(&scene, &job), Vec::new());
//! let rendered = job.render_observed(&scene, &mut CpuExecutor::new()?, &mut |step| {
//!     if images.is_finished(step) {
//!         shown.push(images.read(step)?.image);
//!     }
//!     Ok(())
//! })?;
//! assert_eq!(shown.len(), 3);
//! assert_eq!(shown[2], rendered.image);
//! # Ok::<(), Error>(())
//! ```

use crate::denoise::{self, Denoise};
pub use crate::exec::Progress;
use crate::exec::{Dispatches, Executor, Observer, Step};
use crate::image::{Image, MAX_SIDE};
use crate::moments::Moments;
use crate::plan::{BufferId, FramePlan, Pass, SceneFrame};
use crate::sequence::technique::{Repeats, Technique};
use crate::sequence::{self, Sequence, Share, Stage};
use crate::settings::{More, Settings};
use crate::{Error, buffers::SceneBuffers, memory, scene::Camera};
use restir_kernels::Access;
use restir_shared::layout::FilmPixel;
use std::sync::Arc;

/// Which images a render gives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Shows {
    /// The last one.
    #[default]
    Last,
    /// One after each frame; of samples, one as often as there are twice as many, and later at regular intervals. [`Images`] finds them.
    /// The last one has the same bits in both cases.
    Each,
}

/// What to render, made by [`Self::new`] and changed field by field. Fields may be added with any version.
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
    /// Which images there are.
    pub shows: Shows,
    /// The technique and its settings.
    pub technique: Box<dyn Technique>,
    /// The image is denoised; each frame is, if it is not the mean of all, and frames before the last one help.
    pub denoise: Option<Denoise>,
    #[doc(hidden)]
    pub _more: More,
}

impl Render {
    /// One sample or frame, seen by the scene's camera.
    pub fn new([width, height]: [u32; 2], technique: impl Into<Box<dyn Technique>>) -> Self {
        let technique = technique.into();
        Self {
            width,
            height,
            count: 1,
            accumulate: false,
            seed: 0,
            cameras: Vec::new(),
            shows: Shows::Last,
            technique,
            denoise: None,
            _more: More::default(),
        }
    }

    /// Whether the image is the mean of all samples or frames.
    pub fn is_mean(&self) -> bool {
        self.accumulate || self.technique.about().repeats == Repeats::Samples
    }

    /// How many repeats the image is the mean of.
    pub(crate) fn repeats_in_mean(&self) -> u32 {
        if self.is_mean() { self.count } else { 1 }
    }

    /// Renders `scene`.
    ///
    /// # Errors
    /// Those of [`Self::check`], and whatever the executor reports.
    pub fn render(&self, scene: &SceneBuffers, executor: &mut dyn Executor) -> Result<Rendered, Error> {
        self.render_observed(scene, executor, &mut |_| Ok(()))
    }

    /// As [`Self::render`]; `observe` sees each dispatch when it is done, and may end the render with an error.
    ///
    /// # Errors
    /// As of [`Self::render`], and that of `observe`.
    pub fn render_observed(
        &self,
        scene: &SceneBuffers,
        executor: &mut dyn Executor,
        observe: &mut Observer<'_>,
    ) -> Result<Rendered, Error> {
        self.check(scene)?;
        let plan = self.plan_of(scene, executor.dispatches(), None);
        let (dispatches, counts) = (plan.pass_count, plan.counts);
        Ok(self.rendered(&executor.run_observed(plan, observe)?, dispatches, counts))
    }

    /// Whether the settings are in range and the buffers fit: what [`Self::render`] checks first.
    ///
    /// # Errors
    /// [`Error::InvalidValue`], [`Error::ConflictingSettings`], [`Error::EmptyImage`], [`Error::Size`] and [`Error::NoRepeats`] for what cannot be rendered, [`Error::Memory`] if the buffers would take more than 80 % of the
    /// memory.
    pub fn check(&self, scene: &SceneBuffers) -> Result<(), Error> {
        self.check_settings(scene)?;
        self.check_memory(scene)
    }

    pub(crate) fn check_settings(&self, scene: &SceneBuffers) -> Result<(), Error> {
        let (width, height, technique) = (self.width, self.height, &self.technique);
        let repeats = technique.about().repeats.name();
        if width == 0 || height == 0 {
            return Err(Error::EmptyImage { size: [width, height] });
        }
        if width > MAX_SIDE || height > MAX_SIDE {
            return Err(Error::Size { asked: [width, height], limit: MAX_SIDE });
        }
        if self.count == 0 {
            return Err(Error::NoRepeats { repeats });
        }
        technique.check_ranges()?;
        self.denoise.as_ref().map_or(Ok(()), Settings::check_ranges)?;
        technique.check(scene, self.repeats_in_mean())
    }

    /// Whether each frame is denoised.
    fn denoises_frames(&self) -> bool {
        self.denoise.is_some() && !self.is_mean()
    }

    fn sequence(&self, stage: &Stage) -> Box<dyn Sequence> {
        denoise::sequence(&*self.technique, self.denoise.as_ref(), stage)
    }

    fn check_memory(&self, scene: &SceneBuffers) -> Result<(), Error> {
        // beside the plan: the words read back, the image and its encoded form
        let copies = 3 * u64::from(self.width) * u64::from(self.height) * size_of::<FilmPixel>() as u64;
        // of a scene that moves: the frame in work and the last one
        let moves = scene.is_animated() && self.technique.about().repeats == Repeats::Frames;
        let frames = if moves { 2 * scene.stats().bytes } else { 0 };
        let bytes = self.plan(scene).bytes() + copies + frames;
        memory::check(bytes, "this render", "choose a smaller size or settings that keep less")
    }

    /// The passes of the render, for any executor. They can be made for settings that [`Self::check`] refuses, too.
    pub fn plan<'a>(&'a self, scene: &'a SceneBuffers) -> FramePlan<'a> {
        self.plan_of(scene, Dispatches::Short, None)
    }

    /// [`Self::plan`] in dispatches that may be so long, of the whole image or of a tile of this size and the samples that its share names, as many
    /// as the render counts.
    pub(crate) fn plan_of<'a>(
        &'a self,
        scene: &'a SceneBuffers,
        dispatches: Dispatches,
        share: Option<([u32; 2], Share)>,
    ) -> FramePlan<'a> {
        let (frames, stage) = self.frames(scene, dispatches, share);
        let counted = frames.sequence.counts();
        FramePlan {
            buffers: frames.sequence.buffers().to_vec(),
            pass_count: frames.pass_count(self.sequence(&stage)),
            outputs: std::iter::once(frames.sequence.output()).chain(counted.map(|(buffer, _)| buffer)).collect(),
            counts: counted.map_or([""; 4], |(_, names)| names),
            passes: Box::new(frames),
            scene: Some(Arc::new(scene.clone())),
        }
    }

    /// The passes of [`Self::plan`], frame by frame.
    #[cfg(feature = "languages")]
    pub(crate) fn passes_by_frame<'a>(
        &'a self,
        scene: &'a SceneBuffers,
    ) -> impl Iterator<Item = Result<Vec<Pass>, Error>> + 'a {
        let (mut frames, _) = self.frames(scene, Dispatches::Short, None);
        (0..frames.len()).map(move |_| {
            frames.begin()?;
            std::iter::from_fn(|| frames.next_of_frame()).collect()
        })
    }

    /// The frames, before the first one, and what stays from one to the next.
    fn frames<'a>(
        &'a self,
        scene: &'a SceneBuffers,
        dispatches: Dispatches,
        share: Option<([u32; 2], Share)>,
    ) -> (Frames<'a>, Stage) {
        let moments = match self.technique.about().repeats {
            Repeats::Samples => Moments::still(Arc::new(scene.clone())),
            Repeats::Frames => {
                let looks_back = self.technique.looks_back() || self.denoises_frames();
                let parts = if looks_back && self.count > 1 { 2 } else { 1 };
                Moments::new(Arc::new(scene.clone()), parts)
            }
        };
        let stage = Stage {
            size: share.map_or([self.width, self.height], |(size, _)| size),
            seed: self.seed,
            goes_on: self.count > 1,
            most: self.repeats_in_mean(),
            progressive: self.shows == Shows::Each && self.is_mean(),
            features: scene.features,
            arenas: moments.buffers(),
            dispatches,
            share: share.map(|(_, share)| share),
            given: None,
        };
        let sequence = self.sequence(&stage);
        (Frames { render: self, scene, moments, sequence, next: 0, begun: None }, stage)
    }

    /// What an executor has made of the plan.
    pub(crate) fn rendered(&self, outputs: &[Vec<u32>], dispatches: u64, names: [&'static str; 4]) -> Rendered {
        let pixels: &[FilmPixel] = outputs.first().map_or(&[], |words| bytemuck::cast_slice(words));
        Rendered {
            image: Image { width: self.width, height: self.height, pixels: pixels.iter().map(|p| p.sum).collect() },
            dispatches,
            dropped_samples: pixels.iter().map(|p| p.dropped as u64).sum(),
            counts: counts(outputs.last().map_or(&[], |words| words), names),
        }
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

/// The passes of all frames. Samples are those of a single one.
struct Frames<'a> {
    render: &'a Render,
    scene: &'a SceneBuffers,
    moments: Moments,
    sequence: Box<dyn Sequence>,
    next: u32,
    begun: Option<SceneFrame>,
}

/// More images than this of one render are not needed.
const MOST_IMAGES: u32 = 4096;
/// Between two images are at least so many samples, once there are as many.
const LEAST_INTERVAL: u32 = 64;

/// How many of `count` samples there are when the n-th image of [`Shows::Each`] is made.
fn samples_in(count: u32, images: u32) -> u32 {
    let interval = (count / MOST_IMAGES).max(LEAST_INTERVAL).next_power_of_two();
    let doublings = interval.ilog2();
    let samples = match images.checked_sub(1) {
        None => 0,
        Some(doubled) if doubled <= doublings => 1 << doubled,
        Some(doubled) => u64::from(interval) * u64::from(doubled + 1 - doublings),
    };
    samples.min(u64::from(count)) as u32
}

impl Frames<'_> {
    fn len(&self) -> u32 {
        let Render { count, shows, .. } = *self.render;
        match self.render.technique.about().repeats {
            Repeats::Samples if shows == Shows::Each => {
                (1..).find(|&images| samples_in(count, images) == count).unwrap_or(1)
            }
            Repeats::Samples => 1,
            Repeats::Frames => count.max(1),
        }
    }

    /// Samples of a frame, of techniques that repeat samples.
    fn samples(&self, index: u32) -> u32 {
        let count = self.render.count;
        match self.render.shows {
            Shows::Last => count,
            Shows::Each => samples_in(count, index + 1) - samples_in(count, index),
        }
    }

    /// A frame of the scene where `moments` has it.
    fn frame(&self, index: u32) -> sequence::Frame {
        let Render { width, height, .. } = *self.render;
        let each = self.render.shows == Shows::Each || self.render.denoises_frames();
        let is_last = index + 1 == self.len();
        let is_of_samples = self.render.technique.about().repeats == Repeats::Samples;
        let camera_of =
            |index| self.render.camera(self.scene, if is_of_samples { 0 } else { index }).params(width, height);
        sequence::Frame {
            index,
            samples: self.samples(index),
            camera: camera_of(index),
            last: index.checked_sub(1).map(camera_of),
            scenes: self.moments.headers(),
            features: self.scene.features,
            same_scene: !self.scene.is_animated(),
            primary_given: false,
            clears: false,
            adds: self.render.is_mean() || is_last || each,
            shows: is_last || each,
        }
    }

    /// How many passes there are, by a sequence of their own: once the last camera stays, frames are alike.
    fn pass_count(&self, mut sequence: Box<dyn Sequence>) -> u64 {
        if self.render.shows == Shows::Each {
            let mut passes = |index| {
                sequence.begin(self.frame(index));
                std::iter::from_fn(|| sequence.next_pass()).count() as u64
            };
            return (0..self.len()).map(&mut passes).sum();
        }
        let (len, settling) = (self.len(), self.render.technique.about().settling);
        let settled = (self.render.cameras.len() as u32).saturating_add(settling).min(len - 1);
        let mut work = |index| sequence.begin(self.frame(index)).count();
        let first: u64 = (0..settled).map(&mut work).sum();
        let between = if settled + 1 < len { u64::from(len - 1 - settled) * work(settled) } else { 0 };
        first + between + work(len - 1)
    }

    fn begin(&mut self) -> Result<(), Error> {
        let moves = self.scene.is_animated() && self.render.technique.about().repeats == Repeats::Frames;
        let scene = if moves { Some(Arc::new(self.scene.at(f64::from(self.next))?)) } else { None };
        self.begun = self.moments.advance(scene);
        self.sequence.begin(self.frame(self.next));
        self.next += 1;
        Ok(())
    }

    fn next_of_frame(&mut self) -> Option<Result<Pass, Error>> {
        let pass = self.sequence.next_pass()?;
        Some(pass.map(|pass| Pass { frame: self.begun.take(), ..pass }))
    }
}

impl Iterator for Frames<'_> {
    type Item = Result<Pass, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(pass) = self.next_of_frame() {
                return Some(pass);
            }
            if self.next == self.len() {
                return None;
            }
            if let Err(error) = self.begin() {
                self.next = self.len();
                return Some(Err(error));
            }
        }
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
    /// What else the technique has counted, by name.
    pub counts: Vec<(&'static str, u64)>,
}

/// Sums of what was counted pixel by pixel; nothing of words without a name.
pub(crate) fn counts(words: &[u32], names: [&'static str; 4]) -> Vec<(&'static str, u64)> {
    let sum = |index: usize| words.iter().skip(index).step_by(4).map(|&count| u64::from(count)).sum();
    names.into_iter().enumerate().filter(|(_, name)| !name.is_empty()).map(|(index, name)| (name, sum(index))).collect()
}

/// Finds the images of a render among the passes that an observer sees.
#[derive(Debug)]
pub struct Images<'a> {
    render: &'a Render,
    output: BufferId,
}

impl<'a> Images<'a> {
    /// The images of a render of the scene.
    pub fn new(scene: &SceneBuffers, render: &'a Render) -> Self {
        let output = render.plan(scene).outputs[0];
        Self { render, output }
    }

    /// Whether the pass has finished an image.
    pub fn is_finished(&self, step: &Step<'_>) -> bool {
        self.is_made_by(step.pass)
    }

    pub(crate) fn is_made_by(&self, pass: &Pass) -> bool {
        pass.bindings().any(|(binding, buffer)| binding.access == Access::Own && buffer == self.output)
    }

    /// The image as the pass has left it.
    ///
    /// # Errors
    /// What a GPU reports.
    pub fn read(&self, step: &Step<'_>) -> Result<Rendered, Error> {
        Ok(self.render.rendered(&[step.read(self.output)?], step.progress.done, [""; 4]))
    }

    /// Its pixels.
    pub(crate) fn pixels(&self, step: &Step<'_>) -> Result<Vec<FilmPixel>, Error> {
        Ok(bytemuck::pod_collect_to_vec(&step.read(self.output)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::CpuExecutor;
    use crate::technique;

    /// Whatever is shown on the way, each image is that of a render that ends there, and the passes are as many as was said.
    #[test]
    fn images_on_the_way_are_those_of_shorter_renders() {
        let scene = SceneBuffers::build(&crate::scene::builtin::scene("moving").expect("built in")).expect("builds");
        let mut cpu = CpuExecutor::inline();
        for technique in technique::all() {
            let samples = technique.about().repeats == Repeats::Samples;
            for accumulate in if samples { vec![false] } else { vec![false, true] } {
                let whole = Render { count: 11, accumulate, ..Render::new([9, 7], technique.clone()) };
                let each = Render { shows: Shows::Each, ..whole.clone() };
                let images = Images::new(&scene, &each);
                let (mut shown, mut passes) = (Vec::new(), 0);
                let last = each.render_observed(&scene, &mut cpu, &mut |step| {
                    passes += 1;
                    if images.is_finished(step) {
                        shown.push(images.read(step)?.image);
                    }
                    Ok(())
                });
                let last = last.expect("renders");
                assert_eq!((passes, shown.last()), (last.dispatches, Some(&last.image)));
                let counts = if samples { vec![1, 2, 4, 8, 11] } else { (1..=11).collect() };
                assert_eq!(shown.len(), counts.len());
                for (image, count) in shown.iter().zip(counts) {
                    let alone = Render { count, ..whole.clone() };
                    let alone = alone.render(&scene, &mut cpu).expect("renders").image;
                    assert_eq!(*image, alone, "{} of {count}", technique.about().name);
                }
            }
        }
    }

    #[test]
    fn images_come_in_doublings_and_then_at_intervals() {
        let samples = |count: u32, images: u32| (1..=images).map(|n| samples_in(count, n)).collect::<Vec<_>>();
        assert_eq!(samples(1000, 9), [1, 2, 4, 8, 16, 32, 64, 128, 192]);
        assert_eq!(samples(100, 8), [1, 2, 4, 8, 16, 32, 64, 100]);
        let interval = 1 << 20;
        assert_eq!(samples_in(u32::MAX, 21), interval);
        assert_eq!(samples_in(u32::MAX, 24), 4 * interval);
        assert_eq!(samples_in(u32::MAX, 5000), u32::MAX);
    }
}
