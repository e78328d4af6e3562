//! Frames, and the passes that a technique makes of each.

use crate::Error;
use crate::exec::Dispatches;
use crate::film::Capacity;
use crate::plan::{Buffer, BufferId, Pass};
use restir_shared::layout::{CameraParams, FEATURE_BLEND, SceneHeader};
use restir_shared::scene::GivenPlanes;

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
    /// What the plan makes, if it is less than an image: its output is a sum then.
    pub share: Option<Share>,
    /// Where the embedder gives surfaces, if it does: in the arena of attributes, beyond the scene's.
    pub given: Option<GivenPlanes>,
}

/// Some samples of some pixels of an image, of a technique that repeats samples: the pixels of a tile, which has the size of the stage, and an
/// aligned block of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// Column and row of the tile's upper left pixel.
    pub corner: [u32; 2],
    /// The first sample, a multiple of their number, which is a power of two.
    pub first: u32,
}

impl Stage {
    /// A film for the stage, of `samples` for each repeat, in blocks of at most 2^`largest_block`.
    pub(crate) fn film(&self, samples: u32, largest_block: u32) -> Capacity {
        let samples = self.most.saturating_mul(samples);
        let (progressive, is_sum) = (self.progressive, self.share.is_some());
        Capacity { size: self.size, samples, largest_block, progressive, is_sum }
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
    /// The camera of the last frame; none in the first.
    pub last: Option<CameraParams>,
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
    /// Whether it has the same scene as the last one, and the same ray in every pixel, jitter aside.
    pub(crate) fn is_still(&self) -> bool {
        // a point of a lens is another one each frame
        let is_pinhole = self.camera.lens_right == 0.0 && self.camera.lens_up == 0.0;
        // what is blended is met by the rays of some frames
        let same_scene = self.same_scene && self.features & FEATURE_BLEND == 0;
        same_scene && is_pinhole && self.last == Some(self.camera)
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
