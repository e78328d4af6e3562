//! The native executor: rows of a grid in parallel.

use super::{Description, Dispatches, Executor, Flavour, Observer, Progress, Step};
use crate::plan::{Buffer, BufferId, FramePlan, Pass, Upload, Waiting};
use crate::wide_bvh::WideBvh;
use crate::{Error, buffers::SceneBuffers, error::Cause};
use rayon::prelude::*;
use restir_kernels::{Access, NativeRow, SimdLevel};
use restir_shared::scene::{AnyFrames, Hierarchy, Tracer};
use std::collections::BTreeSet;
use std::num::NonZero;
use std::sync::Arc;

/// Runs kernels natively, on a pool of threads or on the caller's.
#[derive(Debug)]
pub struct CpuExecutor {
    pool: Option<rayon::ThreadPool>,
    instructions: Instructions,
}

/// The instructions that are used: to trace rays, and by kernels that have a form for lanes, if they may run so.
#[derive(Clone, Copy, Debug)]
struct Instructions {
    level: SimdLevel,
    has_lanes: bool,
}

impl Instructions {
    /// All that the processor has.
    fn best() -> Self {
        Self { level: SimdLevel::best(), has_lanes: true }
    }

    /// The level at which kernels run.
    fn of_kernels(self) -> SimdLevel {
        if self.has_lanes { self.level } else { SimdLevel::Portable }
    }
}

impl CpuExecutor {
    /// An executor with as many threads as the process can run at the same time.
    ///
    /// # Errors
    /// [`Error::Threads`] if the threads cannot be started.
    pub fn new() -> Result<Self, Error> {
        // asked here, for rayon would ask the environment first
        Self::with_threads(std::thread::available_parallelism().map_or(1, NonZero::get))
    }

    /// An executor with so many threads.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn with_threads(threads: usize) -> Result<Self, Error> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map(|pool| Self { pool: Some(pool), ..Self::inline() }).map_err(|error| cannot_start(threads, error))
    }

    /// An executor without threads of its own, for renders that are themselves run in parallel.
    pub fn inline() -> Self {
        Self { pool: None, instructions: Instructions::best() }
    }

    /// With the instructions of a level, or of the best below it that this processor has. The bits are the same.
    #[must_use]
    pub fn with_level(self, level: SimdLevel) -> Self {
        Self { instructions: Instructions { level: level.or_below(), ..self.instructions }, ..self }
    }

    /// With kernels that go pixel by pixel, whatever the processor has; rays are traced as before. The bits are the same: it shows what
    /// lanes gain.
    #[must_use]
    pub fn without_lanes(self) -> Self {
        Self { instructions: Instructions { has_lanes: false, ..self.instructions }, ..self }
    }

    /// Runs a pass that fits the buffers and its kernel, over `frames` if there are any. It may begin a frame, and leaves its scenes
    /// in `course`.
    pub(crate) fn run_pass(
        &self,
        pass: &Pass,
        buffers: &mut [Arc<[u32]>],
        course: &mut Course,
        frames: Option<&(dyn AnyFrames + Sync)>,
    ) {
        course.run_pass(pass, buffers, self.instructions, &|dispatch, rows| self.all(dispatch, rows, frames));
    }

    fn all(&self, dispatch: &Dispatch<'_>, rows: Rows<'_>, frames: Option<&(dyn AnyFrames + Sync)>) {
        let row = |y, own| dispatch.row(y, own, frames.map(|frames| frames as &dyn AnyFrames));
        match &self.pool {
            Some(pool) => pool.install(|| rows.into_par_iter().enumerate().for_each(|(y, own)| row(y as u32, own))),
            None => (0..).zip(rows).for_each(|(y, own)| row(y, own)),
        }
    }

    /// As [`Executor::run`], without threads, and over `frames` instead of the scene in the plan's arenas: one that counts what
    /// it is asked, writes it down, or answers differently. It stands for the scene of every pass.
    ///
    /// # Errors
    /// As [`Executor::run`], and [`Error::NotProbed`] for a kernel that probes objects of which `frames` knows nothing.
    pub fn run_over(frames: &dyn AnyFrames, plan: FramePlan<'_>) -> Result<Vec<Vec<u32>>, Error> {
        Self::run_over_observed(frames, plan, &mut |_| Ok(()))
    }

    /// As [`Self::run_over`]; `observe` sees each pass when it is done.
    ///
    /// # Errors
    /// As of [`Self::run_over`], and that of `observe`.
    pub fn run_over_observed(
        frames: &dyn AnyFrames,
        plan: FramePlan<'_>,
        observe: &mut Observer<'_>,
    ) -> Result<Vec<Vec<u32>>, Error> {
        let checked = |pass: Result<Pass, Error>| pass.and_then(|pass| check_probes(&pass, frames).map(|()| pass));
        let plan = FramePlan { passes: Box::new(plan.passes.map(checked)), ..plan };
        run(plan, observe, Instructions::best(), &|dispatch, rows| {
            (0..).zip(rows).for_each(|(y, own)| dispatch.row(y, own, Some(frames)));
        })
    }
}

fn cannot_start(threads: usize, error: impl Into<Cause>) -> Error {
    Error::Threads { count: threads, source: error.into() }
}

/// Whether a pass finds in `frames` what it asks.
pub(crate) fn check_probes(pass: &Pass, frames: &dyn AnyFrames) -> Result<(), Error> {
    if !pass.kernel.probes || frames.probed(false).is_some() {
        return Ok(());
    }
    Err(Error::NotProbed { kernel: pass.kernel.name })
}

/// What passes leave to those after them, beside the buffers.
pub(crate) struct Course {
    /// The scenes of this frame and of the last one, where there are better structures to trace rays in than the arenas.
    pub(crate) scenes: [Option<Arc<SceneBuffers>>; 2],
    /// Planes in which nothing waits, as a pass has found that asked, and no other has written since.
    at_rest: BTreeSet<BufferId>,
}

/// A pass and what it reads.
struct Dispatch<'a> {
    pass: &'a Pass,
    read: Vec<&'a [u32]>,
    tracers: [Tracer<'a>; 2],
    lanes: SimdLevel,
}

/// For each row of a grid its part of the buffers that the pass writes.
type Rows<'a> = Vec<Vec<&'a mut [u32]>>;

impl Dispatch<'_> {
    fn row(&self, y: u32, own: Vec<&mut [u32]>, frames: Option<&dyn AnyFrames>) {
        // for as long as the row
        let mut own: Vec<&mut [u32]> = own;
        (self.pass.kernel.native)(&mut NativeRow {
            x: 0,
            y,
            width: self.pass.grid[0],
            constants: &self.pass.constants,
            params: &self.pass.params,
            read: &self.read,
            own: &mut own,
            tracers: self.tracers,
            frames,
            lanes: self.lanes,
        });
    }
}

/// Runs the rows of a pass.
type AllRows<'a> = dyn Fn(&Dispatch<'_>, Rows<'_>) + 'a;

/// Runs a plan.
fn run(
    plan: FramePlan<'_>,
    observe: &mut Observer<'_>,
    instructions: Instructions,
    all: &AllRows<'_>,
) -> Result<Vec<Vec<u32>>, Error> {
    // shared with the plan until a pass writes them
    let mut buffers: Vec<Arc<[u32]>> = plan.buffers.iter().map(Buffer::initial).collect();
    let mut course = Course::new([plan.scene.clone(), plan.scene]);
    for (done, pass) in (1..).zip(plan.passes) {
        let pass = pass?;
        pass.check(&plan.buffers)?;
        course.run_pass(&pass, &mut buffers, instructions, all);
        let progress = Progress { done, total: plan.pass_count };
        observe(&Step::new(progress, &pass, &|id| Ok(buffers[id].to_vec())))?;
    }
    Ok(plan.outputs.iter().map(|&id| buffers[id].to_vec()).collect())
}

impl Course {
    /// Begins with the scenes of this frame and of the last one.
    pub(crate) fn new(scenes: [Option<Arc<SceneBuffers>>; 2]) -> Self {
        Self { scenes, at_rest: BTreeSet::new() }
    }

    /// Runs a pass over the scenes of this frame and of the other one, if it has work.
    fn run_pass(&mut self, pass: &Pass, buffers: &mut [Arc<[u32]>], instructions: Instructions, all: &AllRows<'_>) {
        if let Some(frame) = &pass.frame {
            for Upload { buffer, first, words } in &frame.uploads {
                Arc::make_mut(&mut buffers[*buffer])[*first..][..words.len()].copy_from_slice(words);
                self.at_rest.remove(buffer);
            }
            self.scenes = frame.scenes.clone().map_or([None, None], |scenes| scenes.map(Some));
        }
        if pass.waiting.is_none_or(|waiting| self.has_work(pass, waiting, buffers)) {
            let level = instructions.level;
            let tree = |scene: &Option<Arc<SceneBuffers>>| Some(scene.as_ref()?.tracer().clone().with_level(level));
            dispatch(pass, buffers, &self.scenes.each_ref().map(tree), instructions.of_kernels(), all);
            for (_, id) in pass.bindings().filter(|(binding, _)| binding.access == Access::Own) {
                self.at_rest.remove(&id);
            }
        }
    }

    /// Whether any element waits for the pass. A plane that is at rest is not looked at again: of the passes that a sample may need, most
    /// come after its last path has ended.
    fn has_work(&mut self, pass: &Pass, waiting: Waiting, buffers: &[Arc<[u32]>]) -> bool {
        let Waiting { buffer, word, bits } = waiting;
        if self.at_rest.contains(&buffer) {
            return false;
        }
        let elements = buffers[buffer].chunks_exact(pass.own_words(buffer).unwrap_or(1));
        let works = elements.filter_map(|element| element.get(word)).any(|word| word & bits != 0);
        if !works {
            self.at_rest.insert(buffer);
        }
        works
    }
}

/// Runs a pass over scenes, with rays traced in `trees`.
fn dispatch(
    pass: &Pass,
    buffers: &mut [Arc<[u32]>],
    trees: &[Option<WideBvh>; 2],
    lanes: SimdLevel,
    all: &AllRows<'_>,
) {
    let tracers = trees.each_ref().map(|tree| tree.as_ref().map(|tree| tree as &(dyn Hierarchy + Sync)));
    let bound = |access| pass.bindings().filter(move |(binding, _)| binding.access == access);
    let mut own: Vec<Arc<[u32]>> = bound(Access::Own).map(|(_, id)| std::mem::take(&mut buffers[id])).collect();
    let read = bound(Access::Read).map(|(_, id)| &*buffers[id]).collect();
    let mut rows: Rows<'_> = (0..pass.grid[1]).map(|_| Vec::with_capacity(own.len())).collect();
    for ((binding, _), words) in bound(Access::Own).zip(&mut own) {
        let parts = Arc::make_mut(words).chunks_exact_mut(binding.stride as usize / 4 * pass.grid[0] as usize);
        rows.iter_mut().zip(parts).for_each(|(row, part)| row.push(part));
    }
    all(&Dispatch { pass, read, tracers, lanes }, rows);
    bound(Access::Own).zip(own).for_each(|((_, id), words)| buffers[id] = words);
}

impl Executor for CpuExecutor {
    fn describe(&self) -> Description {
        Description { executor: "cpu", adapter: None, flavour: Flavour::Exact, parity: None }
    }

    fn dispatches(&self) -> Dispatches {
        Dispatches::Long
    }

    fn run_observed(&mut self, plan: FramePlan<'_>, observe: &mut Observer<'_>) -> Result<Vec<Vec<u32>>, Error> {
        run(plan, observe, self.instructions, &|dispatch, rows| self.all(dispatch, rows, None))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Also of a number that nobody gave.
    #[test]
    fn threads_that_cannot_be_started_are_told_as_a_number() {
        let said = [1, 16].map(|threads| cannot_start(threads, "Resource temporarily unavailable").to_string());
        let end = "Resource temporarily unavailable; ask for fewer, or end other programs";
        assert_eq!(said, [format!("cannot start a thread: {end}"), format!("cannot start 16 threads: {end}")]);
    }
}
