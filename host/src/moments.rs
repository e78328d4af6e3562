//! A scene in the arenas of a plan, frame by frame.

use crate::buffers::SceneBuffers;
use crate::plan::{ARENAS, Buffer, BufferId, SceneFrame, Upload};
use restir_shared::layout::{NONE, SceneHeader};
use std::{ops::Range, sync::Arc};

/// Words that are compared, and written, together.
const BLOCK: usize = 1024;

/// A scene in the arenas. The frames of one that moves take turns in the parts of the geometry and of the attribute arena: while
/// this frame is written into one part, the last one stays in the other.
#[derive(Clone)]
pub(crate) struct Moments {
    scene: Arc<SceneBuffers>,
    /// What each part holds: one part, where the last frame is not looked back at, and none where nothing moves.
    parts: Vec<Option<Arc<SceneBuffers>>>,
    /// This frame and the last one of a scene that moves; none before the first.
    placed: Option<[Placed; 2]>,
}

/// A frame and where it is in the arenas.
#[derive(Clone)]
struct Placed {
    scene: Arc<SceneBuffers>,
    header: SceneHeader,
    part: usize,
}

impl Moments {
    /// With one part, or with two for the last frame.
    pub(crate) fn new(scene: Arc<SceneBuffers>, parts: usize) -> Self {
        let parts = if scene.is_animated() { parts } else { 0 };
        Self { scene, parts: vec![None; parts], placed: None }
    }

    /// The moments of a scene as it stands, whether it moves or not.
    pub(crate) fn still(scene: Arc<SceneBuffers>) -> Self {
        Self { scene, parts: Vec::new(), placed: None }
    }

    fn is_still(&self) -> bool {
        self.parts.is_empty()
    }

    /// The arenas, of which the geometry and the attributes of a scene that moves are written frame by frame.
    pub(crate) fn buffers(&self) -> [Buffer; 3] {
        let mut arenas = Buffer::arenas(&self.scene);
        if !self.is_still() {
            for (arena, words) in arenas.iter_mut().zip(self.scene.most_words()) {
                (arena.words, arena.contents) = (self.parts.len() * words, None);
            }
        }
        arenas
    }

    /// The scene as it stands.
    pub(crate) fn scene(&self) -> &Arc<SceneBuffers> {
        self.placed.as_ref().map_or(&self.scene, |[this, _]| &this.scene)
    }

    /// The scene in this frame and in the last one.
    #[cfg(feature = "gpu")]
    pub(crate) fn scenes(&self) -> [&Arc<SceneBuffers>; 2] {
        self.placed.as_ref().map_or([&self.scene; 2], |placed| placed.each_ref().map(|frame| &frame.scene))
    }

    /// The headers of this frame and of the last one.
    pub(crate) fn headers(&self) -> [SceneHeader; 2] {
        let placed = self.placed.as_ref();
        placed.map_or([self.scene.header; 2], |placed| placed.each_ref().map(|frame| frame.header))
    }

    /// The last frame is forgotten, and what the arenas hold: a frame that was recorded and never submitted has not written them.
    pub(crate) fn forget(&mut self) {
        self.scene = self.scene().clone();
        self.placed = None;
        self.parts.fill(None);
    }

    /// Goes on to a frame, in which the scene is another one or, with `None`, as it was. There is nothing to do where it stands still.
    /// One that may move is given with its first frame.
    pub(crate) fn advance(&mut self, changed: Option<Arc<SceneBuffers>>) -> Option<SceneFrame> {
        if self.is_still() {
            return None;
        }
        let before = self.placed.take();
        let Some(scene) = changed else {
            let [mut this, _] = before?;
            this.header.counterpart_base = NONE;
            let scenes = [this.scene.clone(), this.scene.clone()];
            self.placed = Some([this.clone(), this]);
            return Some(SceneFrame { uploads: Vec::new(), scenes: Some(scenes) });
        };
        let part = before.as_ref().map_or(0, |[last, _]| (last.part + 1) % self.parts.len());
        let [geometry, attributes] = self.scene.most_words().map(|words| part * words);
        let held = self.parts[part].replace(scene.clone());
        let mut uploads = changes(ARENAS[0].1, geometry, held.as_ref().map(|held| &held.geometry), &scene.geometry);
        uploads.extend(changes(ARENAS[1].1, attributes, held.as_ref().map(|held| &held.attributes), &scene.attributes));
        let mut end = attributes + scene.attributes.len();
        let header = scene.header.moved((geometry / 4) as u32, (attributes / 4) as u32);
        let mut this = Placed { header, scene: scene.clone(), part };
        let mut last = before.filter(|_| self.parts.len() > 1).map_or_else(|| this.clone(), |[last, _]| last);
        // what the last frame knew of the one before is gone
        for (from, to) in [(&mut this, &last.scene.clone()), (&mut last, &scene)] {
            from.header.counterpart_base = NONE;
            if let Some(words) = from.scene.counterparts(to) {
                from.header.counterpart_base = (end / 4) as u32;
                let next = end + words.len();
                uploads.push(Upload { buffer: ARENAS[1].1, first: end, words });
                end = next;
            }
        }
        let scenes = [this.scene.clone(), last.scene.clone()];
        self.placed = Some([this, last]);
        Some(SceneFrame { uploads, scenes: Some(scenes) })
    }
}

/// What has to be written where a buffer holds `held` from its word `first` on, and shall hold `words`. Beyond what was held may be
/// anything.
fn changes(buffer: BufferId, first: usize, held: Option<&Arc<[u32]>>, words: &Arc<[u32]>) -> Vec<Upload> {
    let held: &[u32] = held.map_or(&[], |held| held);
    let differs = |block: &Range<usize>| held.get(block.clone()) != Some(&words[block.clone()]);
    let blocks = (0..words.len()).step_by(BLOCK).map(|at| at..words.len().min(at + BLOCK)).filter(differs);
    let mut runs: Vec<Range<usize>> = Vec::new();
    for block in blocks {
        match runs.last_mut() {
            Some(run) if run.end == block.start => run.end = block.end,
            _ => runs.push(block),
        }
    }
    let part = |run: Range<usize>| if run.len() == words.len() { words.clone() } else { words[run].into() };
    runs.into_iter().map(|run| Upload { buffer, first: first + run.start, words: part(run) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_blocks_that_differ_are_written() {
        let old: Arc<[u32]> = (0..10 * BLOCK as u32).collect();
        let mut new = old.to_vec();
        new.extend([7; 3]);
        (new[BLOCK], new[2 * BLOCK + 5], new[5 * BLOCK - 1]) = (1, 2, 3);
        let new: Arc<[u32]> = new.into();
        let uploads = changes(1, 100, Some(&old), &new);
        let places: Vec<_> = uploads.iter().map(|upload| (upload.first - 100, upload.words.len())).collect();
        assert_eq!(places, [(BLOCK, 2 * BLOCK), (4 * BLOCK, BLOCK), (10 * BLOCK, 3)]);
        let mut there = [old.to_vec(), vec![0; 3]].concat();
        for Upload { first, words, .. } in &uploads {
            there[first - 100..][..words.len()].copy_from_slice(words);
        }
        assert_eq!(there, &new[..]);
        assert!(changes(1, 0, Some(&new), &new).is_empty());
        assert!(Arc::ptr_eq(&changes(1, 0, None, &new)[0].words, &new));
    }
}
