//! Scenes, executors and images around the ReSTIR kernels; the program `restir` is a crate of its own.
//!
//! A [`scene::Scene`] is what a user edits. It becomes [`buffers::SceneBuffers`], the arenas that kernels read, with a BVH and tables of
//! lights. A [`technique`] makes a [`plan::FramePlan`] of it, buffers and passes, and an [`exec::Executor`] runs the plan natively or on a
//! GPU, with the same bits. [`Render::render`](render::Render::render) does all of that for one image, and a [`session`] frame by frame for a renderer that shows
//! each of them.
//!
//! What this documentation hides, tests and tools of the repository use. It may change with any version.
//!
//! ```
//! use restir_host::render::Render;
//! use restir_host::technique::path::PathSettings;
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 4, ..Render::new([32, 24], PathSettings::default()) };
//! let rendered = job.render(&scene, &mut CpuExecutor::new()?)?;
//!
//! let mean = rendered.image.pixels.iter().map(|rgb| rgb[1]).sum::<f32>() / (32.0 * 24.0);
//! assert!((mean - 0.094).abs() < 0.01 && rendered.dropped_samples == 0);
//! # Ok::<(), Error>(())
//! ```

mod alias;
pub mod aov;
mod artifact;
pub mod buffers;
mod bvh;
pub mod checkpoint;
#[doc(hidden)]
pub mod compact;
pub mod denoise;
#[doc(hidden)]
pub mod distribution;
pub mod error;
pub mod exec;
mod film;
pub mod foreign;
pub mod image;
#[doc(hidden)]
pub mod input;
#[cfg(feature = "languages")]
pub mod language;
mod layered;
pub mod memory;
pub mod metrics;
mod moments;
#[cfg(feature = "oidn")]
pub mod oidn;
pub mod output;
pub mod part;
pub mod plan;
#[cfg(feature = "languages")]
pub mod plan_file;
#[cfg(feature = "exr")]
pub mod reference;
pub mod render;
pub mod replay;
pub mod scene;
#[doc(hidden)]
pub mod self_check;
pub mod sequence;
pub mod session;
pub mod settings;
#[doc(hidden)]
pub mod spirv;
pub mod technique;
pub mod tonemap;
pub mod wide_bvh;

pub use artifact::Shaders;
pub use error::Error;
#[cfg(feature = "gpu")]
pub use wgpu;
