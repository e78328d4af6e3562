//! The project's own tools, behind `cargo xtask`.
//!
//! It is a library too, so that integration tests can feed modules to the post-pass and to the checks.
#![allow(missing_debug_implementations, reason = "nobody prints what tools are made of")]

pub mod device;
pub mod documented;
pub mod error;
pub mod mutate;
pub mod package;
pub mod planted;
mod process;
pub mod shader;
pub mod surface;

pub use error::Error;
