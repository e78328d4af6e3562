//! Scenes, executors and images around the ReSTIR kernels.

pub mod error;
pub mod image;
pub mod metrics;
pub mod output;
pub mod scene;

pub use error::Error;
