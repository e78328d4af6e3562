//! Scenes, executors and images around the ReSTIR kernels; the program `restir` is a crate of its own.
//!
//! `Scene` (what a user edits) becomes [`buffers::SceneBuffers`] (arenas, BVH, alias tables), a technique makes a
//! [`plan::FramePlan`] of it, and an [`exec::Executor`] runs the plan natively or on a GPU.

mod alias;
pub mod aov;
mod artifact;
pub mod bootstrap;
pub mod buffers;
mod bvh;
pub mod checkpoint;
pub mod compact;
pub mod distribution;
pub mod error;
pub mod exec;
mod film;
pub mod foreign;
pub mod image;
pub mod input;
pub mod memory;
pub mod metrics;
mod moments;
pub mod output;
pub mod plan;
#[cfg(feature = "exr")]
pub mod reference;
pub use technique::render;
pub mod replay;
pub mod scene;
pub mod scrambles;
pub mod self_check;
pub mod session;
pub mod settings;
pub mod spirv;
pub mod technique;
pub mod tonemap;
pub mod trial;
pub mod wide_bvh;

pub use artifact::Shaders;
pub use error::Error;
#[cfg(feature = "gpu")]
pub use wgpu;
