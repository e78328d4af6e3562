//! Executors run frame plans: [`CpuExecutor`] natively, and `GpuExecutor` on a GPU.
//!
//! An observer sees every pass when it is done, and may read any buffer of the plan or end the work.
//!
//! ```
//! use restir_host::exec::{CpuExecutor, Executor};
//! use restir_host::render::Render;
//! use restir_host::technique::restir_di::DiSettings;
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//! use restir_shared::layout::FilmPixel;
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 2, ..Render::new([16, 16], DiSettings::default()) };
//! let (plan, mut kernels) = (job.plan(&scene), Vec::new());
//! let passes = plan.pass_count;
//! let outputs = CpuExecutor::new()?.run_observed(plan, &mut |step| {
//!     kernels.push(step.pass.kernel.name);
//!     Ok(())
//! })?;
//! assert_eq!(kernels.len() as u64, passes);
//! assert!(kernels.contains(&"di_initial"));
//! assert_eq!(outputs[0].len() * 4, 16 * 16 * size_of::<FilmPixel>());
//! # Ok::<(), Error>(())
//! ```

mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

pub use cpu::CpuExecutor;
pub(crate) use cpu::{Course, check_probes};
#[cfg(feature = "gpu")]
pub use gpu::GpuExecutor;

pub use restir_kernels::spirv::Flavour;

use crate::Error;
use crate::plan::{BufferId, FramePlan, Pass};
use bytemuck::Pod;
use std::fmt;

/// How a GPU's results compare with the host's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Parity {
    /// The same bits.
    Exact,
    /// Different bits, at most this many units in the last place apart.
    Approximate {
        /// The largest distance.
        max_ulp: u32,
    },
}

impl fmt::Display for Parity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exact => f.write_str("exact"),
            Self::Approximate { max_ulp } => write!(f, "approximate (max {max_ulp} ulp)"),
        }
    }
}

/// How long dispatches may be. It does not change the bits.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Dispatches {
    /// As short as GPUs ask for, whose drivers limit the time of a dispatch and the rounds of an invocation's loops.
    #[default]
    Short,
    /// As long as suits the host, which traces rays of a pixel together: the more of its samples there are in a dispatch, the better.
    Long,
}

/// What an executor is.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// "cpu" or "gpu".
    pub executor: &'static str,
    /// Name and driver of the adapter.
    pub adapter: Option<String>,
    /// Which build of the kernels it runs.
    pub flavour: Flavour,
    /// The result of the self-check, once it was made.
    pub parity: Option<Parity>,
}

impl Description {
    /// Where the bits come from: "exact", or the device that has others.
    pub(crate) fn origin(&self) -> String {
        let exact = self.flavour == Flavour::Exact && !matches!(self.parity, Some(Parity::Approximate { .. }));
        match &self.adapter {
            Some(adapter) if !exact => format!("{adapter}, {}", self.flavour),
            _ => "exact".to_owned(),
        }
    }
}

/// How far some work is, in passes or whatever it consists of.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// What is done.
    pub done: u64,
    /// What there is to do in all.
    pub total: u64,
}

/// A pass that is done, and the buffers after it.
pub struct Step<'a> {
    /// How many of the plan's passes are done.
    pub progress: Progress,
    /// The last of them.
    pub pass: &'a Pass,
    read: &'a dyn Fn(BufferId) -> Result<Vec<u32>, Error>,
}

/// Sees each pass when it is done, and may end the work with an error.
pub type Observer<'a> = dyn FnMut(&Step<'_>) -> Result<(), Error> + 'a;

impl fmt::Debug for Step<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { progress, pass, .. } = self;
        f.debug_struct("Step").field("progress", progress).field("pass", pass).finish_non_exhaustive()
    }
}

impl<'a> Step<'a> {
    /// For executors: `read` copies a buffer of the plan.
    pub fn new(progress: Progress, pass: &'a Pass, read: &'a dyn Fn(BufferId) -> Result<Vec<u32>, Error>) -> Self {
        Self { progress, pass, read }
    }

    /// The words of a buffer of the plan as the pass left it.
    ///
    /// # Errors
    /// What a GPU reports.
    pub fn read(&self, buffer: BufferId) -> Result<Vec<u32>, Error> {
        (self.read)(buffer)
    }

    /// The elements of the buffer that the pass binds to `role`, as it left them.
    ///
    /// # Errors
    /// As [`Self::read`]; [`Error::Kernel`] if the kernel has no binding of that name.
    pub fn plane<T: Pod>(&self, role: &str) -> Result<Vec<T>, Error> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(self.pass.bound(role)?)?))
    }
}

/// Runs frame plans.
pub trait Executor {
    /// What it is.
    fn describe(&self) -> Description;

    /// How long the dispatches may be that it is given.
    fn dispatches(&self) -> Dispatches {
        Dispatches::Short
    }

    /// Runs all passes in order and gives the words of the output buffers.
    ///
    /// # Errors
    /// On a GPU [`Error::Kernel`], [`Error::Binding`], [`Error::AdapterMemory`] and [`Error::Adapter`].
    fn run(&mut self, plan: FramePlan<'_>) -> Result<Vec<Vec<u32>>, Error> {
        self.run_observed(plan, &mut |_| Ok(()))
    }

    /// As [`Self::run`]; `observe` sees each pass when it is done.
    ///
    /// # Errors
    /// As of [`Self::run`], and that of `observe`, by convention [`Error::Interrupted`] where it only ends the work.
    fn run_observed(&mut self, plan: FramePlan<'_>, observe: &mut Observer<'_>) -> Result<Vec<Vec<u32>>, Error>;
}
