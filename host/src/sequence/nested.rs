//! Frames of a technique within those of another one.

use super::frames::{Frame, Sequence, Stage};
use super::technique::Technique;
use crate::Error;
use crate::plan::{Buffer, BufferId, Pass};

/// Frames of a technique within those of another one, whose buffers come after its own: each of them makes a picture alone.
pub(crate) struct Within {
    sequence: Box<dyn Sequence>,
    /// Samples of which a picture is the mean, of techniques that repeat these.
    samples: u32,
}

impl Within {
    /// The frames of `technique` on the stage of the other one, with so many samples each if it repeats these, else 1.
    pub(crate) fn new(technique: &dyn Technique, stage: &Stage, samples: u32) -> Self {
        Self::by(|stage| technique.sequence(stage), stage, samples)
    }

    /// The same of a sequence that is made on this stage.
    pub(crate) fn by(make: impl FnOnce(&Stage) -> Box<dyn Sequence>, stage: &Stage, samples: u32) -> Self {
        let stage = Stage { most: samples, progressive: false, ..stage.clone() };
        Self { sequence: make(&stage), samples }
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
