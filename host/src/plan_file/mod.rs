//! A render as data, for programs in any language: `plan.json`, the first contents of buffers, and the kernels.
//!
//! ```text
//! Render, SceneBuffers ──> Plan ──> folder ──> whoever reads JSON and drives a GPU
//!   (passes frame by        │         │
//!    frame, folded)         └─────────┴──> FramePlan, for this library's executors
//! ```
//!
//! `docs/plans.md` of the repository describes the format for readers.
//!
//! ```
//! use restir_host::exec::{CpuExecutor, Executor};
//! use restir_host::plan_file::Plan;
//! use restir_host::render::Render;
//! use restir_host::technique::restir_di::DiSettings;
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 3, ..Render::new([16, 16], DiSettings::default()) };
//! let plan = Plan::of(&job, &scene, &[])?;
//!
//! // what was written down renders the same bits
//! let words = CpuExecutor::inline().run(plan.frames()?)?.swap_remove(0);
//! let pixels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&words);
//! let image = job.render(&scene, &mut CpuExecutor::inline())?.image;
//! assert!(pixels.iter().zip(&image.pixels).all(|(pixel, rgb)| pixel[..3] == rgb[..]));
//! # Ok::<(), Error>(())
//! ```

mod document;
mod fold;
mod form;
mod make;
mod read;

pub use document::{
    BindingEntry, BufferEntry, ChangeEntry, Document, FORMAT, FieldEntry, KernelEntry, ModuleEntry, NAME, OutputEntry,
    PassEntry, UploadEntry, VERSION,
};
pub use form::Form;

use restir_kernels::KernelDesc;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A kernel and the values of its specialization constants.
type Specialised = (&'static KernelDesc, Vec<u32>);

/// A document and the files that it names.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What `plan.json` says.
    pub document: Document,
    /// The files by their names.
    pub files: BTreeMap<String, Contents>,
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Contents {
    /// Words of 32 bits, least byte first.
    Words(Arc<[u32]>),
    /// A text.
    Text(String),
}

impl Contents {
    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::Words(words) => bytemuck::cast_slice(words),
            Self::Text(text) => text.as_bytes(),
        }
    }
}
