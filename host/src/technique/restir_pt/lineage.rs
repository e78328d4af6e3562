//! Where a pixel's path comes from: the passes of a render with all that they read, so that each pixel of one can be replayed natively,
//! whatever executor ran it.

use crate::plan::{BufferId, Pass};
use crate::{Error, buffers::SceneBuffers, exec::Step, render::Render, replay::TwoFrames};
use restir_kernels::restir_pt::{pt_merge, pt_pair, pt_recall, pt_reproject, pt_retrace, pt_shift, pt_trace};
use restir_shared::scene::Frames;
use restir_shared::shift::{Shifted, Start};
use restir_shared::technique::restir_pt::{
    self as pt, Job, JobShifted, Merged, PT_BACK, PT_OTHER_FRAME, PT_STILL, PackedPath, PtParams, Shares,
};
use std::{collections::BTreeMap, sync::Arc};

/// Where a pass has a pixel's path from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The pixel has traced it.
    Traced,
    /// Another pass has left it.
    Path {
        /// Index of that pass among those that leave paths.
        made_by: usize,
        /// Index of the pixel.
        pixel: u32,
        /// It is not what the pixel had.
        is_other: bool,
    },
}

/// Paths as a pass left them.
#[derive(Clone)]
pub(super) struct Paths {
    pub(super) words: Arc<[PackedPath]>,
    pub(super) made_by: usize,
}

/// A pass of shifts, with what it read.
pub(super) struct ShiftPass {
    pub(super) params: PtParams,
    pub(super) jobs: Arc<[Job]>,
    frames: Arc<TwoFrames>,
    starts: Arc<[Start]>,
    paths: Paths,
    words: Arc<[JobShifted]>,
}

impl ShiftPass {
    /// What becomes of a job, computed once more, with the Jacobian; of no job nothing.
    pub(super) fn replay(&self, job: usize) -> Option<(Shifted, f32)> {
        let named = self.jobs[job];
        let shifted = (named != Job::NONE)
            .then(|| pt::shifted_job(&&*self.frames, &self.params, named, &self.starts, &self.paths.words))?;
        Some((shifted, shifted.term / self.paths.words[named.path as usize].term()))
    }

    /// Whether it takes paths to the pixels of the picture, and not from them to the last frame.
    pub(super) fn is_to_pixels(&self) -> bool {
        self.params.flags & PT_BACK == 0
    }
}

/// What a path is in the other frame's scene.
type Recall = fn(&&TwoFrames, &PtParams, PackedPath) -> PackedPath;

/// How a pass makes paths.
enum How {
    Trace,
    /// In the other frame's scene, of what another pass has left: by this function.
    Recall(Paths, Recall),
    /// Of what pixels have and what others offer: none of whose paths are shifted in a view that stands still.
    Merge {
        own: Paths,
        others: Paths,
        there: Option<Arc<ShiftPass>>,
        back: Option<Arc<ShiftPass>>,
    },
}

/// A pass that leaves paths.
pub(super) struct PathPass {
    pub(super) params: PtParams,
    pub(super) made: Paths,
    frames: Arc<TwoFrames>,
    how: How,
}

impl PathPass {
    pub(super) fn is_merge(&self) -> bool {
        matches!(self.how, How::Merge { .. })
    }

    pub(super) fn is_trace(&self) -> bool {
        matches!(self.how, How::Trace)
    }

    pub(super) fn is_temporal(&self) -> bool {
        self.params.flags & PT_OTHER_FRAME != 0
    }

    /// The shifts whose results it selects from, if there are any.
    pub(super) fn shifts(&self) -> Option<&ShiftPass> {
        match &self.how {
            How::Merge { there: Some(there), .. } => Some(there),
            _ => None,
        }
    }

    /// The path of a pixel, computed once more, and where it comes from.
    pub(super) fn replay(&self, pixel: u32) -> (PackedPath, Origin) {
        let (frames, p) = (&&*self.frames, &self.params);
        let at = [pixel % p.width, pixel / p.width];
        match &self.how {
            How::Trace => (pt::trace(&frames.scene(false), p, at).path, Origin::Traced),
            How::Recall(before, recall) => {
                let origin = Origin::Path { made_by: before.made_by, pixel, is_other: false };
                (recall(frames, p, before.words[pixel as usize]), origin)
            }
            How::Merge { own, others, there, back } => {
                let words = |pass: &'_ Option<Arc<ShiftPass>>| pass.as_ref().map(|pass| pass.words.clone());
                let (shifted, returned) = (words(there).unwrap_or_default(), words(back).unwrap_or_default());
                let jobs = there.as_ref().map(|pass| pass.jobs.clone()).unwrap_or_default();
                let shares = Shares { paths: &others.words, jobs: &jobs, shifted: &shifted, returned: &returned };
                let Merged { path, is_other, job } = pt::merge(p, &shares, own.words[pixel as usize], at);
                let of_job = jobs.get(job as usize).map_or(pixel, |job| job.path);
                let (made_by, pixel) = if is_other { (others.made_by, of_job) } else { (own.made_by, pixel) };
                (path, Origin::Path { made_by, pixel, is_other })
            }
        }
    }
}

/// Follows the paths of a render from pass to pass.
pub(super) struct Follower {
    frames: Arc<TwoFrames>,
    features: u32,
    starts: BTreeMap<BufferId, Arc<[Start]>>,
    jobs: Arc<[Job]>,
    paths: BTreeMap<BufferId, Paths>,
    shifts: BTreeMap<BufferId, Arc<ShiftPass>>,
    /// Passes so far that have left paths.
    passes: usize,
}

impl Follower {
    pub(super) fn new(scene: &SceneBuffers, render: &Render) -> Self {
        let features = render.technique.integral().features(scene.features);
        Self {
            frames: Arc::new(TwoFrames::still(scene, features)),
            features,
            starts: BTreeMap::new(),
            jobs: [].into(),
            paths: BTreeMap::new(),
            shifts: BTreeMap::new(),
            passes: 0,
        }
    }

    /// The pass of shifts that the step was, if it was one that [`Self::follow`] has seen.
    pub(super) fn shifts(&self, step: &Step<'_>) -> Option<Arc<ShiftPass>> {
        let is_shift = step.pass.kernel.name == pt_shift::DESC.name;
        let plane = step.pass.bound("shifted").ok().filter(|_| is_shift)?;
        self.shifts.get(&plane).cloned()
    }

    /// The passes whose paths are still in some plane are kept; the step's, if it left paths. Every step of the render has to be shown.
    ///
    /// # Errors
    /// What a GPU reports, and [`Error::Kernel`] if a pass reads a plane that no step before has made.
    pub(super) fn follow(&mut self, step: &Step<'_>) -> Result<Option<PathPass>, Error> {
        if let Some(scenes) = step.pass.frame.as_ref().and_then(|frame| frame.scenes.clone()) {
            self.frames = Arc::new(TwoFrames::new(scenes, self.features));
        }
        let (pass, name) = (step.pass, step.pass.kernel.name);
        let Some(params) = pass.params::<PtParams>() else { return Ok(None) };
        if name == pt_trace::DESC.name {
            self.starts.insert(pass.bound("starts")?, step.plane("starts")?.into());
            self.left(step, "paths", params, How::Trace).map(Some)
        } else if name == pt_recall::DESC.name {
            let before = known(&self.paths, pass, "paths")?;
            let recall: Recall = |frames, params, path| pt::recall(frames, params, path);
            self.left(step, "paths", params, How::Recall(before, recall)).map(Some)
        } else if name == pt_retrace::DESC.name {
            let before = known(&self.paths, pass, "paths")?;
            let recall: Recall = |frames, params, path| pt::retrace(frames, params, path);
            self.left(step, "retraced", params, How::Recall(before, recall)).map(Some)
        } else if name == pt_merge::DESC.name {
            let how = self.merge(pass, &params)?;
            self.left(step, "merged", params, how).map(Some)
        } else if name == pt_shift::DESC.name {
            let (starts, paths) = (known(&self.starts, pass, "starts")?, known(&self.paths, pass, "paths")?);
            let (words, jobs, frames) = (step.plane("shifted")?.into(), self.jobs.clone(), self.frames.clone());
            let made = ShiftPass { params, jobs, frames, starts, paths, words };
            self.shifts.insert(pass.bound("shifted")?, Arc::new(made));
            Ok(None)
        } else {
            if [pt_pair::DESC.name, pt_reproject::DESC.name].contains(&name) {
                self.jobs = step.plane("jobs")?.into();
            }
            Ok(None)
        }
    }

    fn merge(&self, pass: &Pass, params: &PtParams) -> Result<How, Error> {
        let others = known(&self.paths, pass, "paths")?;
        let (crosses, still) = (params.flags & PT_OTHER_FRAME != 0, params.flags & PT_STILL != 0);
        let shifts = |role, used: bool| used.then(|| known(&self.shifts, pass, role)).transpose();
        Ok(How::Merge {
            own: if crosses { known(&self.paths, pass, "merged")? } else { others.clone() },
            others,
            there: shifts("shifted", !still)?,
            back: shifts("returned", crosses && !still)?,
        })
    }

    fn left(&mut self, step: &Step<'_>, role: &str, params: PtParams, how: How) -> Result<PathPass, Error> {
        let made = Paths { words: step.plane(role)?.into(), made_by: self.passes };
        self.paths.insert(step.pass.bound(role)?, made.clone());
        self.passes += 1;
        Ok(PathPass { params, made, frames: self.frames.clone(), how })
    }
}

/// What an earlier pass left in the buffer of a role.
fn known<T: Clone>(planes: &BTreeMap<BufferId, T>, pass: &Pass, role: &str) -> Result<T, Error> {
    let plane = planes.get(&pass.bound(role)?).cloned();
    let problem = || format!("reads {role} that no pass before it has made; show every pass of the render");
    plane.ok_or_else(|| Error::Kernel { kernel: pass.kernel.name.to_owned(), problem: problem() })
}
