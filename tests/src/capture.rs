//! The passes of a plan, each with what its buffers hold before it runs.

use crate::native;
use bytemuck::Pod;
use restir_host::Error;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::plan::{Buffer, FramePlan, Pass};
use restir_kernels::{Access, Binding, KernelDesc, NativeRow, SimdLevel};
use restir_shared::scene::{AnyScene, Still};
use std::sync::Arc;

/// A pass and the words of its buffers before it, in the order of its bindings.
#[derive(Clone)]
pub struct Capture {
    /// The pass.
    pub pass: Pass,
    /// What it finds.
    pub contents: Vec<Arc<[u32]>>,
}

/// Runs a plan natively.
///
/// # Errors
/// As of the executor.
pub fn captured(plan: FramePlan<'_>) -> Result<Vec<Capture>, Error> {
    let mut buffers: Vec<Arc<[u32]>> = plan.buffers.iter().map(Buffer::initial).collect();
    let mut captures = Vec::new();
    CpuExecutor::inline().run_observed(plan, &mut |step| {
        let pass = step.pass;
        for upload in pass.frame.iter().flat_map(|frame| &frame.uploads) {
            let words = &mut Arc::make_mut(&mut buffers[upload.buffer])[upload.first..];
            words[..upload.words.len()].copy_from_slice(&upload.words);
        }
        let contents = pass.bindings.iter().map(|&id| buffers[id].clone()).collect();
        captures.push(Capture { pass: pass.clone(), contents });
        for (binding, id) in pass.bindings() {
            if binding.access == Access::Own {
                buffers[id] = step.read(id)?.into();
            }
        }
        Ok(())
    })?;
    Ok(captures)
}

/// The last of a kernel's passes.
///
/// # Panics
/// If it has none.
pub fn last<'a>(captures: &'a [Capture], kernel: &KernelDesc) -> &'a Capture {
    let found = captures.iter().rev().find(|capture| capture.pass.kernel.name == kernel.name);
    found.unwrap_or_else(|| panic!("the plan has no pass of {}", kernel.name))
}

impl Capture {
    /// The parameter block.
    ///
    /// # Panics
    /// If it is of another size.
    pub fn params<P: Pod>(&self) -> P {
        self.pass.params().expect("the kernel has these parameters")
    }

    /// The elements that the buffer of a role holds.
    ///
    /// # Panics
    /// If the kernel has no binding of that name.
    pub fn plane<T: Pod>(&self, role: &str) -> Vec<T> {
        let found = self.pass.bindings().zip(&self.contents).find(|((binding, _), _)| binding.name == role);
        let (_, words) = found.unwrap_or_else(|| panic!("{} has no {role}", self.pass.kernel.name));
        bytemuck::pod_collect_to_vec(words)
    }

    /// The same pass with other parameters, see [`native::edit`].
    #[must_use]
    pub fn edited<P: Pod>(&self, edit: impl FnOnce(&mut P)) -> Self {
        let mut edited = self.clone();
        native::edit(&mut edited.pass, edit);
        edited
    }

    /// Every position of the grid, rows from top to bottom.
    pub fn positions(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let [width, height] = self.pass.grid;
        (0..height).flat_map(move |y| (0..width).map(move |x| [x, y]))
    }

    /// Runs a single invocation over a scene: the elements that it leaves in the buffers it writes, in their order.
    pub fn invoke(&self, scene: &dyn AnyScene, [x, y]: [u32; 2]) -> Vec<Vec<u32>> {
        let at = (y * self.pass.grid[0] + x) as usize;
        let of = |access| {
            let bound = self.pass.bindings().zip(&self.contents).map(|((binding, _), words)| (binding, words));
            bound.filter(move |(binding, _)| binding.access == access)
        };
        let read: Vec<&[u32]> = of(Access::Read).map(|(_, words)| &**words).collect();
        let element = |(binding, words): (&Binding, &Arc<[u32]>)| {
            let stride = binding.stride as usize / 4;
            words[at * stride..][..stride].to_vec()
        };
        let mut own: Vec<Vec<u32>> = of(Access::Own).map(element).collect();
        (self.pass.kernel.native)(&mut NativeRow {
            x,
            y,
            width: 1,
            constants: &self.pass.constants,
            params: &self.pass.params,
            read: &read,
            own: &mut own.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>(),
            tracers: [None; 2],
            frames: Some(&Still(scene)),
            lanes: SimdLevel::best(),
        });
        own
    }
}
