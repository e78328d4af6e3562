//! The frames of a scene that moves, in the arenas of a plan.

use crate::Error;
use crate::buffers::SceneBuffers;
use crate::plan::{ARENAS, Buffer, SceneFrame, Upload};
use restir_shared::layout::{NONE, SceneHeader};
use std::sync::Arc;

/// A scene whose frames take turns in the parts of the geometry and of the attribute arena: while this frame is written
/// into one part, the last one stays in the other.
pub(super) struct Moments<'a> {
    scene: &'a SceneBuffers,
    parts: usize,
    /// Words of 32 bits in a part of either arena.
    words: [usize; 2],
    /// This frame and the last one.
    placed: Option<[Placed; 2]>,
}

/// A frame and its header in the arenas.
#[derive(Clone)]
struct Placed {
    scene: Arc<SceneBuffers>,
    header: SceneHeader,
}

impl<'a> Moments<'a> {
    /// With one part, or with two for the last frame.
    pub(super) fn new(scene: &'a SceneBuffers, parts: usize) -> Self {
        Self { scene, parts, words: scene.most_words(), placed: None }
    }

    /// The geometry and the attribute arena, which are written frame by frame.
    pub(super) fn buffers(&self) -> [Buffer; 2] {
        let arena = |name, words| Buffer { name, words: self.parts * words, contents: None };
        [arena("geometry", self.words[0]), arena("attributes", self.words[1])]
    }

    /// The headers of this frame and of the last one; none before the first.
    pub(super) fn headers(&self) -> Option<[SceneHeader; 2]> {
        self.placed.as_ref().map(|placed| placed.each_ref().map(|frame| frame.header))
    }

    /// Goes on to a frame, whose index is its time.
    pub(super) fn advance(&mut self, frame: u32) -> Result<SceneFrame, Error> {
        let scene = Arc::new(self.scene.at(f64::from(frame))?);
        let [geometry, attributes] = self.words.map(|words| frame as usize % self.parts * words);
        let upload =
            |arena: usize, first, words: &Arc<[u32]>| Upload { buffer: ARENAS[arena].1, first, words: words.clone() };
        let mut uploads = vec![upload(0, geometry, &scene.geometry), upload(1, attributes, &scene.attributes)];
        let mut end = attributes + scene.attributes.len();
        let mut this =
            Placed { header: scene.header.moved((geometry / 4) as u32, (attributes / 4) as u32), scene: scene.clone() };
        let mut last = self.placed.take().filter(|_| self.parts > 1).map_or_else(|| this.clone(), |[last, _]| last);
        // what the last frame knew of the one before is gone
        for (from, to) in [(&mut this, &last.scene.clone()), (&mut last, &scene)] {
            from.header.counterpart_base = NONE;
            if let Some(words) = from.scene.counterparts(to) {
                from.header.counterpart_base = (end / 4) as u32;
                uploads.push(upload(1, end, &words));
                end += words.len();
            }
        }
        let scenes = Some([this.scene.clone(), last.scene.clone()]);
        self.placed = Some([this, last]);
        Ok(SceneFrame { uploads, scenes })
    }
}
