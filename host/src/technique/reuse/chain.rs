//! The chain of frames of a technique that reuses: a frame makes a record for each pixel, merges it with that of the last frame, then with
//! those of neighbours, and shades what is left. A technique says what its passes are ([`Passes`]); planes, history, film and the order
//! of the passes are the chain's.

use super::planes::Planes;
use super::{PassParams, Specialises};
use crate::Error;
use crate::film::{self, Film};
use crate::plan::{Buffer, BufferId, Pass};
use crate::technique::Integral;
use crate::technique::sequence::{Frame, Sequence, Stage, Within, Work};
use restir_kernels::KernelDesc;
use restir_shared::layout::CameraParams;
use restir_shared::resample::params::ReuseParams;
use std::collections::VecDeque;

/// The passes of a technique. Each function pushes those of one step of a frame, in order.
pub(crate) trait Passes: Send {
    /// Leaves a new record for each pixel in the plane in work ([`Queue::work`]).
    fn initial(&self, queue: &mut Queue, now: &Frame);

    /// Merges the records of the last frame ([`Queue::history`]), which `last` saw, into those in work, in place.
    fn reuse_in_time(&self, queue: &mut Queue, now: &Frame, last: CameraParams);

    /// Merges the records of neighbours in the plane in work into the plane `merged`: the pass of spatial reuse of that number, from 0.
    fn reuse_in_space(&self, queue: &mut Queue, now: &Frame, pass: u32, merged: BufferId);

    /// Shades the records in work, by [`Queue::shade`] if the frame is added to the film.
    fn shade(&self, queue: &mut Queue, now: &Frame);

    /// See [`Sequence::primary`].
    fn primary(&self, frame: u32) -> Option<BufferId> {
        let _ = frame;
        None
    }
}

/// The parameters of passes within a frame, from those of any frame.
pub(crate) fn of_frame<P: PassParams>(params: &P, now: &Frame) -> P {
    let mut params = *params;
    let [scene, _] = now.scenes;
    *params = ReuseParams { scene, other_scene: scene, ..params.of_frame(now.index, now.camera) };
    params
}

/// What a chain reuses, and how often a frame is shaded.
#[derive(Clone, Copy)]
pub(crate) struct Reuses {
    /// Records of the last frame.
    pub(crate) in_time: bool,
    /// Passes over records of neighbours.
    pub(crate) in_space: u32,
    /// The next frame reuses what these passes have made, not what they began with.
    pub(crate) feedback: bool,
    /// How often a frame that is added to the film is shaded.
    pub(crate) shadings: u32,
}

/// The passes of a frame that are still to come, and what they are made of.
pub(crate) struct Queue {
    size: [u32; 2],
    integral: Integral,
    reuses: Reuses,
    planes: Planes,
    film: Film,
    /// How many frames up to this one had the scene and the rays of the one before.
    pub(crate) still_for: u32,
    passes: VecDeque<Result<Pass, Error>>,
    work: Work,
}

impl Queue {
    /// The plane of the records in work.
    pub(crate) fn work(&self) -> BufferId {
        self.planes.records[0]
    }

    /// The plane of the last frame's records.
    pub(crate) fn history(&self) -> BufferId {
        self.planes.records[self.planes.records.len() - 1]
    }

    /// What saw the last frame, if its records are reused.
    pub(crate) fn last(&self, now: &Frame) -> Option<CameraParams> {
        now.last.filter(|_| self.reuses.in_time)
    }

    /// Adds a pass. These roles of the kernel are bound to these planes, and all others to the planes of their names.
    pub(crate) fn push(
        &mut self,
        now: &Frame,
        kernel: &'static KernelDesc,
        params: &impl Specialises,
        bound: &[(&'static str, BufferId)],
    ) {
        let constants = [("features", self.integral.features(now.features)), ("settings", params.settings())];
        let bound = self.planes.bound(now.index, bound);
        self.extend([Pass::new(kernel, &constants, params, &bound)]);
    }

    /// Adds passes that are the same in every frame.
    pub(crate) fn push_all(&mut self, passes: &[Pass]) {
        self.extend(passes.iter().cloned().map(Ok));
    }

    /// Adds a pass that cannot be made, in whose place is the reason.
    pub(crate) fn fail(&mut self, reason: &Error) {
        self.extend([Err(Error::Plan { problem: reason.to_string() })]);
    }

    /// Adds the pass that adds the picture `left` to the picture `right`.
    pub(crate) fn push_sum(&mut self, left: BufferId, right: BufferId) {
        self.extend([film::add(self.size, left, right)]);
    }

    /// Adds the passes of the technique within, if there is one: the plane of its picture.
    pub(crate) fn push_within(&mut self, now: &Frame) -> Option<BufferId> {
        let within = self.planes.within.as_mut()?;
        let (picture, passes) = (within.picture(), within.passes(now).collect::<Vec<_>>());
        self.extend(passes);
        Some(picture)
    }

    /// The plane of the picture of the technique within, as far as there is one.
    pub(crate) fn within(&self) -> Option<BufferId> {
        self.planes.within.as_ref().map(Within::picture)
    }

    /// Adds the passes that shade a frame into a plane of the film, which is given to `push`.
    pub(crate) fn shade(&mut self, push: impl FnOnce(&mut Self, BufferId)) {
        let Some(plane) = self.film.open(0) else { return };
        push(self, plane);
        self.work.blocks += 1;
        self.passes.extend(std::iter::from_fn(|| self.film.merge_equal()));
    }

    fn extend(&mut self, passes: impl IntoIterator<Item = Result<Pass, Error>>) {
        let before = self.passes.len();
        self.passes.extend(passes);
        self.work.passes += (self.passes.len() - before) as u64;
    }
}

/// The chain of frames, of which each reuses the last one.
pub(crate) struct Chain<P> {
    passes: P,
    queue: Queue,
}

impl<P: Passes> Chain<P> {
    /// The frames on a stage of an image of `integral`, over these planes.
    pub(crate) fn new(stage: &Stage, integral: Integral, reuses: Reuses, mut planes: Planes, passes: P) -> Self {
        let film = Film::new(&mut planes.buffers, stage.film(reuses.shadings, 0));
        let (waiting, work) = (VecDeque::new(), Work::default());
        let queue = Queue { size: stage.size, integral, reuses, planes, film, still_for: 0, passes: waiting, work };
        Self { passes, queue }
    }
}

impl<P: Passes> Sequence for Chain<P> {
    fn buffers(&self) -> &[Buffer] {
        &self.queue.planes.buffers
    }

    fn output(&self) -> BufferId {
        self.queue.film.output()
    }

    fn primary(&self, frame: u32) -> Option<BufferId> {
        self.passes.primary(frame)
    }

    fn begin(&mut self, now: Frame) -> Work {
        let Self { passes, queue } = self;
        queue.passes.clear();
        queue.work = Work::default();
        queue.still_for = if now.is_still() { queue.still_for.saturating_add(1) } else { 0 };
        if now.clears {
            queue.film.clear();
        }
        passes.initial(queue, &now);
        if let Some(last) = queue.last(&now) {
            passes.reuse_in_time(queue, &now, last);
        }
        let Reuses { in_time, in_space, feedback, .. } = queue.reuses;
        // what the next frame reuses is not written over
        let held = (in_time && !feedback).then_some(queue.work());
        for pass in 0..in_space {
            let Some(free) = queue.planes.free(held) else { break };
            passes.reuse_in_space(queue, &now, pass, free);
            queue.planes.put(free, 0);
        }
        passes.shade(queue, &now);
        if now.shows {
            queue.passes.extend(queue.film.image());
        }
        if in_time {
            let last = queue.planes.records.len() - 1;
            queue.planes.put(held.unwrap_or(queue.work()), last);
        }
        queue.work
    }

    fn next_pass(&mut self) -> Option<Result<Pass, Error>> {
        self.queue.passes.pop_front()
    }
}
