//! The native executor: rows of a grid in parallel.

use super::{Description, Executor, Flavour, Step};
use crate::Error;
use crate::buffers::SceneBuffers;
use crate::plan::{FramePlan, Pass, Upload};
use rayon::prelude::*;
use restir_kernels::{Access, NativeRow};
use restir_shared::scene::{AnyFrames, Trace, Tracer};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Runs kernels natively, on a pool of threads or on the caller's.
pub struct CpuExecutor {
    pool: Option<rayon::ThreadPool>,
}

/// A buffer: shared with the plan until a pass writes it.
enum Storage {
    Shared(Arc<[u32]>),
    Owned(Vec<u32>),
}

impl Storage {
    fn words(&self) -> &[u32] {
        match self {
            Self::Shared(words) => words,
            Self::Owned(words) => words,
        }
    }

    fn write(&mut self, upload: &Upload) {
        let mut words = self.take();
        words[upload.first..][..upload.words.len()].copy_from_slice(&upload.words);
        *self = Self::Owned(words);
    }

    fn take(&mut self) -> Vec<u32> {
        match self {
            Self::Shared(words) => words.to_vec(),
            Self::Owned(words) => std::mem::take(words),
        }
    }
}

impl CpuExecutor {
    /// An executor with the given number of threads, or one a core.
    ///
    /// # Errors
    /// [`Error::Setting`] if the threads cannot be started.
    pub fn new(threads: Option<usize>) -> Result<Self, Error> {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.unwrap_or(0))
            .build()
            .map(|pool| Self { pool: Some(pool) })
            .map_err(|e| Error::Setting(format!("cannot start {threads:?} threads: {e}; ask for fewer")))
    }

    /// An executor without threads of its own, for renders that are themselves run in parallel.
    pub fn inline() -> Self {
        Self { pool: None }
    }

    /// As [`Executor::run`], without threads, and over `frames` instead of the scene in the plan's arenas: one that counts what
    /// it is asked, writes it down, or answers differently. It stands for the scene of every pass.
    ///
    /// # Errors
    /// As [`Executor::run`].
    pub fn run_over(
        frames: &dyn AnyFrames,
        plan: FramePlan<'_>,
        observe: &mut dyn FnMut(&Step<'_>) -> ControlFlow<()>,
    ) -> Result<Vec<Vec<u32>>, Error> {
        run(plan, observe, &|dispatch, rows| {
            (0..).zip(rows).for_each(|(y, own)| dispatch.row(y, own, Some(frames)));
        })
    }
}

/// A pass and what it reads.
struct Dispatch<'a> {
    pass: &'a Pass,
    read: Vec<&'a [u32]>,
    tracers: [Tracer<'a>; 2],
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
        });
    }
}

/// Runs a plan; `all` runs the rows of a pass.
fn run(
    plan: FramePlan<'_>,
    observe: &mut dyn FnMut(&Step<'_>) -> ControlFlow<()>,
    all: &dyn Fn(&Dispatch<'_>, Rows<'_>),
) -> Result<Vec<Vec<u32>>, Error> {
    let mut buffers: Vec<Storage> = plan
        .buffers
        .iter()
        .map(|b| b.contents.clone().map_or_else(|| Storage::Owned(vec![0; b.words]), Storage::Shared))
        .collect();
    let mut frame_scenes = None;
    for (done, pass) in (1..).zip(plan.passes) {
        let pass = pass?;
        pass.check(&plan.buffers)?;
        if let Some(frame) = &pass.frame {
            for upload in &frame.uploads {
                buffers[upload.buffer].write(upload);
            }
            frame_scenes = Some(frame.scenes.clone());
        }
        // of this frame and of the other one
        let scenes: [Option<&SceneBuffers>; 2] = match &frame_scenes {
            None => [plan.scene; 2],
            Some(None) => [None; 2],
            Some(Some(scenes)) => scenes.each_ref().map(|scene| Some(&**scene)),
        };
        let tracers = scenes.map(|scene| scene.map(|scene| scene.tracer() as &(dyn Trace + Sync)));
        run_pass(&pass, &mut buffers, tracers, all);
        if observe(&Step::new(done, &pass, &|id| Ok(buffers[id].words().to_vec()))).is_break() {
            return Err(Error::Interrupted);
        }
    }
    Ok(plan.outputs.iter().map(|&id| buffers[id].words().to_vec()).collect())
}

fn run_pass(pass: &Pass, buffers: &mut [Storage], tracers: [Tracer<'_>; 2], all: &dyn Fn(&Dispatch<'_>, Rows<'_>)) {
    let bound = |access| {
        let bindings = pass.kernel.bindings.iter().skip(1).zip(&pass.bindings);
        bindings.filter(move |(binding, _)| binding.access == access).map(|(binding, &id)| (binding.stride, id))
    };
    let mut own: Vec<Vec<u32>> = bound(Access::Own).map(|(_, id)| buffers[id].take()).collect();
    let read = bound(Access::Read).map(|(_, id)| buffers[id].words()).collect();
    let strides: Vec<usize> =
        bound(Access::Own).map(|(stride, _)| stride as usize / 4 * pass.grid[0] as usize).collect();
    all(&Dispatch { pass, read, tracers }, rows(&mut own, &strides, pass.grid[1]));
    for ((_, id), words) in bound(Access::Own).zip(own) {
        buffers[id] = Storage::Owned(words);
    }
}

/// Cuts every buffer into its rows: for each row the parts of all buffers.
fn rows<'a>(own: &'a mut [Vec<u32>], strides: &[usize], height: u32) -> Rows<'a> {
    let mut rows: Rows<'_> = (0..height).map(|_| Vec::with_capacity(strides.len())).collect();
    for (buffer, &stride) in own.iter_mut().zip(strides) {
        for (row, part) in rows.iter_mut().zip(buffer.chunks_exact_mut(stride)) {
            row.push(part);
        }
    }
    rows
}

impl Executor for CpuExecutor {
    fn describe(&self) -> Description {
        Description { executor: "cpu", adapter: None, flavour: Flavour::Exact, parity: None }
    }

    fn run(
        &mut self,
        plan: FramePlan<'_>,
        observe: &mut dyn FnMut(&Step<'_>) -> ControlFlow<()>,
    ) -> Result<Vec<Vec<u32>>, Error> {
        run(plan, observe, &|dispatch, rows| match &self.pool {
            Some(pool) => pool.install(|| {
                rows.into_par_iter().enumerate().for_each(|(y, own)| dispatch.row(y as u32, own, None));
            }),
            None => (0..).zip(rows).for_each(|(y, own)| dispatch.row(y, own, None)),
        })
    }
}
