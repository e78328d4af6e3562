//! The frames of a scene in the arenas of a plan, for techniques that render frame by frame.

use crate::plan::{ARENAS, Buffer, SceneFrame, Upload};
use crate::{Error, buffers::SceneBuffers};
use restir_shared::layout::{NONE, SceneHeader};
use std::sync::Arc;

/// A scene in the arenas. The frames of one that moves take turns in the parts of the geometry and of the attribute arena: while
/// this frame is written into one part, the last one stays in the other.
#[derive(Clone)]
pub(crate) struct Moments<'a> {
    scene: &'a SceneBuffers,
    parts: usize,
    /// This frame and the last one of a scene that moves; none before the first.
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
    pub(crate) fn new(scene: &'a SceneBuffers, parts: usize) -> Self {
        Self { scene, parts, placed: None }
    }

    /// The arenas, of which the geometry and the attributes of a scene that moves are written frame by frame.
    pub(crate) fn buffers(&self) -> Vec<Buffer> {
        let mut arenas = Buffer::arenas(self.scene);
        if self.scene.is_animated() {
            for (arena, words) in arenas.iter_mut().zip(self.scene.most_words()) {
                (arena.words, arena.contents) = (self.parts * words, None);
            }
        }
        arenas.into()
    }

    /// The headers of this frame and of the last one.
    pub(crate) fn headers(&self) -> [SceneHeader; 2] {
        let placed = self.placed.as_ref();
        placed.map_or([self.scene.header; 2], |placed| placed.each_ref().map(|frame| frame.header))
    }

    /// Goes on to a frame, whose index is its time; there is nothing to do where the scene stands still.
    pub(crate) fn advance(&mut self, frame: u32) -> Result<Option<SceneFrame>, Error> {
        if !self.scene.is_animated() {
            return Ok(None);
        }
        let scene = Arc::new(self.scene.at(f64::from(frame))?);
        let [geometry, attributes] = self.scene.most_words().map(|words| frame as usize % self.parts * words);
        let upload =
            |arena: usize, first, words: &Arc<[u32]>| Upload { buffer: ARENAS[arena].1, first, words: words.clone() };
        let mut uploads = vec![upload(0, geometry, &scene.geometry), upload(1, attributes, &scene.attributes)];
        let mut end = attributes + scene.attributes.len();
        let header = scene.header.moved((geometry / 4) as u32, (attributes / 4) as u32);
        let mut this = Placed { header, scene: scene.clone() };
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
        Ok(Some(SceneFrame { uploads, scenes }))
    }
}
