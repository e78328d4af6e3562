//! Scenes, executors and images around the ReSTIR kernels.

pub mod error;
pub mod scene;

pub use error::Error;
