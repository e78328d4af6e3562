//! The passes of a technique, frame by frame. A [`Sequence`] is what a technique gives to whoever drives it: a whole render or a session.
//!
//! ```
//! use restir_host::exec::Dispatches;
//! use restir_host::plan::Buffer;
//! use restir_host::technique::sequence::{Frame, Stage};
//! use restir_host::technique::{Technique, path::PathSettings};
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let (size, features, arenas) = ([16, 16], scene.features, Buffer::arenas(&scene));
//! let dispatches = Dispatches::Short;
//! let stage = Stage { size, seed: 7, goes_on: false, most: 4, progressive: false, features, arenas, dispatches };
//! let mut sequence = PathSettings::default().sequence(&stage);
//!
//! sequence.begin(Frame {
//!     index: 0,
//!     samples: 4,
//!     camera: scene.camera.params(16, 16),
//!     scenes: [scene.header; 2],
//!     features,
//!     same_scene: true,
//!     primary_given: false,
//!     clears: true,
//!     adds: true,
//!     shows: true,
//! });
//! let mut kernels = Vec::new();
//! while let Some(pass) = sequence.next_pass() {
//!     kernels.push(pass?.kernel.name);
//! }
//! assert_eq!(kernels, ["path", "film_resolve"]);
//! # Ok::<(), Error>(())
//! ```

use crate::Error;
use crate::exec::Dispatches;
use crate::film::Capacity;
use crate::plan::{Buffer, BufferId, Pass};
use crate::technique::Technique;
use restir_shared::layout::{CameraParams, FEATURE_BLEND, SceneHeader};

/// What stays from frame to frame.
#[derive(Clone, Debug)]
pub struct Stage {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Seed of the random numbers.
    pub seed: u32,
    /// More than one frame will be made.
    pub goes_on: bool,
    /// Most repeats that the image is a mean of: frames, or samples.
    pub most: u32,
    /// The mean is shown while repeats are still to come.
    pub progressive: bool,
    /// Feature bits of the scene, of all times.
    pub features: u32,
    /// The arenas of the scene, which come first among the buffers.
    pub arenas: [Buffer; 3],
    /// How long dispatches may be. Buffers do not depend on it.
    pub dispatches: Dispatches,
}

impl Stage {
    /// A film for the stage, of `samples` for each repeat, in blocks of at most 2^`largest_block`.
    pub(crate) fn film(&self, samples: u32, largest_block: u32) -> Capacity {
        let samples = self.most.saturating_mul(samples);
        Capacity { size: self.size, samples, largest_block, progressive: self.progressive }
    }
}

/// One frame.
#[derive(Clone, Debug)]
pub struct Frame {
    /// How many frames there were before it.
    pub index: u32,
    /// Samples a pixel, of techniques that repeat samples.
    pub samples: u32,
    /// The camera.
    pub camera: CameraParams,
    /// Where this frame's scene and the last one's are in the arenas.
    pub scenes: [SceneHeader; 2],
    /// Feature bits of the scene, of all times.
    pub features: u32,
    /// The scene is that of the last frame.
    pub same_scene: bool,
    /// What the camera sees is in its plane already, so that nobody has to look for it.
    pub primary_given: bool,
    /// The film begins anew.
    pub clears: bool,
    /// The frame is added to the film.
    pub adds: bool,
    /// The mean of the film is made.
    pub shows: bool,
}

impl Frame {
    /// Whether it has the same scene as the last one, which `last_camera` saw, and the same ray in every pixel, jitter aside.
    pub(crate) fn is_still(&self, last_camera: Option<CameraParams>) -> bool {
        // a point of a lens is another one each frame
        let is_pinhole = self.camera.lens_right == 0.0 && self.camera.lens_up == 0.0;
        // what is blended is met by the rays of some frames
        let same_scene = self.same_scene && self.features & FEATURE_BLEND == 0;
        same_scene && is_pinhole && last_camera == Some(self.camera)
    }
}

/// Frames of a technique within those of another one, whose buffers come after its own: each of them makes a picture alone.
pub(crate) struct Within {
    sequence: Box<dyn Sequence>,
    /// Samples of which a picture is the mean, of techniques that repeat these.
    samples: u32,
}

impl Within {
    /// The frames of `technique` on the stage of the other one, with so many samples each if it repeats these, else 1.
    pub(crate) fn new(technique: &dyn Technique, stage: &Stage, samples: u32) -> Self {
        let stage = Stage { most: samples, progressive: false, ..stage.clone() };
        Self { sequence: technique.sequence(&stage), samples }
    }

    /// The buffers that a technique begins with: the arenas, and those of what is rendered within it, if anything is.
    pub(crate) fn buffers(within: Option<&Self>, stage: &Stage) -> Vec<Buffer> {
        within.map_or_else(|| stage.arenas.to_vec(), |within| within.sequence.buffers().to_vec())
    }

    /// The plane of its picture, of [`restir_shared::layout::FilmPixel`].
    pub(crate) fn picture(&self) -> BufferId {
        self.sequence.output()
    }

    /// The passes of a frame; they make its picture if the frame is added to the film.
    pub(crate) fn passes(&mut self, now: &Frame) -> impl Iterator<Item = Result<Pass, Error>> {
        let alone = Frame { samples: self.samples, primary_given: false, clears: true, shows: now.adds, ..now.clone() };
        self.sequence.begin(alone);
        std::iter::from_fn(|| self.sequence.next_pass())
    }
}

/// How much work a frame is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Passes, but for those of the film.
    pub passes: u64,
    /// Blocks of samples that go into the film: the passes that add them up, and divide the sum, are as many, over all frames.
    pub blocks: u64,
}

impl Work {
    /// How many passes it stands for.
    pub(crate) fn count(self) -> u64 {
        self.passes + self.blocks
    }
}

/// Makes the passes of one frame after another, over buffers that stay. What an earlier sequence left in them does not matter.
pub trait Sequence: Send {
    /// The buffers: the arenas and the planes.
    fn buffers(&self) -> &[Buffer];

    /// The buffer that holds the image after a frame that shows it.
    fn output(&self) -> BufferId;

    /// The buffer of what was counted pixel by pixel, four words each, and what they count; a word without a name counts nothing.
    fn counts(&self) -> Option<(BufferId, [&'static str; 4])> {
        None
    }

    /// The buffer that holds what the camera sees, element by element a [`restir_shared::geometry::PackedHit`]: who writes it
    /// before a frame gives it ([`Frame::primary_given`]).
    fn primary(&self, frame: u32) -> Option<BufferId> {
        let _ = frame;
        None
    }

    /// Begins a frame. What was left of the one before is dropped.
    fn begin(&mut self, frame: Frame) -> Work;

    /// The next pass of the frame.
    fn next_pass(&mut self) -> Option<Result<Pass, Error>>;
}
