//! Scenes, executors and images around the ReSTIR kernels.
//!
//! `Scene` (what a user edits) becomes [`buffers::SceneBuffers`] (arenas, BVH, alias tables), a technique makes a
//! [`plan::FramePlan`] of it, and an [`exec::Executor`] runs the plan natively or on a GPU.

mod alias;
mod artifact;
#[cfg(feature = "cli")]
mod bench;
pub mod bootstrap;
pub mod buffers;
mod bvh;
#[cfg(feature = "cli")]
pub mod cli;
pub mod compact;
pub mod di;
pub mod distribution;
pub mod error;
pub mod exec;
#[cfg(feature = "cli")]
mod figure;
mod film;
pub mod image;
mod input;
mod memory;
pub mod metrics;
pub mod output;
pub mod plan;
pub mod reference;
pub mod render;
pub mod replay;
pub mod scene;
pub mod self_check;
pub mod spirv;
pub mod wide_bvh;

pub use artifact::Shaders;
pub use error::Error;
#[cfg(feature = "gpu")]
pub use wgpu;
