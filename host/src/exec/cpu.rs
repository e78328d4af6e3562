//! The native executor: rows of a grid in parallel.

use super::{Description, Executor, Flavour, Step};
use crate::Error;
use crate::buffers::SceneBuffers;
use crate::plan::{FramePlan, Pass, Upload};
use rayon::prelude::*;
use restir_kernels::{Access, NativeRow};
use restir_shared::scene::{Trace, Tracer};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Runs kernels natively on a pool of threads.
pub struct CpuExecutor {
    pool: rayon::ThreadPool,
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
            .map(|pool| Self { pool })
            .map_err(|e| Error::Setting(format!("cannot start {threads:?} threads: {e}; ask for fewer")))
    }

    fn pass(&self, pass: &Pass, buffers: &mut [Storage], tracers: [Tracer<'_>; 2]) {
        let bindings = pass.kernel.bindings.iter().skip(1).zip(&pass.bindings);
        let strides: Vec<usize> = bindings
            .clone()
            .filter(|(b, _)| b.access == Access::Own)
            .map(|(b, _)| b.stride as usize / 4 * pass.grid[0] as usize)
            .collect();
        let ids: Vec<usize> = bindings.clone().filter(|(b, _)| b.access == Access::Own).map(|(_, &id)| id).collect();
        let mut own: Vec<Vec<u32>> = ids.iter().map(|&id| buffers[id].take()).collect();
        let read: Vec<&[u32]> =
            bindings.filter(|(b, _)| b.access == Access::Read).map(|(_, &id)| buffers[id].words()).collect();
        self.pool.install(|| {
            rows(&mut own, &strides, pass.grid[1]).into_par_iter().enumerate().for_each(|(y, mut own)| {
                (pass.kernel.native)(&mut NativeRow {
                    y: y as u32,
                    width: pass.grid[0],
                    constants: &pass.constants,
                    params: &pass.params,
                    read: &read,
                    own: &mut own,
                    tracers,
                    frames: None,
                });
            });
        });
        for (id, words) in ids.into_iter().zip(own) {
            buffers[id] = Storage::Owned(words);
        }
    }
}

/// Cuts every buffer into its rows: for each row the parts of all buffers.
fn rows<'a>(own: &'a mut [Vec<u32>], strides: &[usize], height: u32) -> Vec<Vec<&'a mut [u32]>> {
    let mut rows: Vec<Vec<&mut [u32]>> = (0..height).map(|_| Vec::with_capacity(strides.len())).collect();
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
            self.pass(&pass, &mut buffers, tracers);
            if observe(&Step::new(done, &pass, &|id| Ok(buffers[id].words().to_vec()))).is_break() {
                return Err(Error::Interrupted);
            }
        }
        Ok(plan.outputs.iter().map(|&id| buffers[id].words().to_vec()).collect())
    }
}
