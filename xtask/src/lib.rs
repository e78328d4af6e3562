//! The project's own tools, behind `cargo xtask`.
//!
//! It is a library too, so that integration tests can feed modules to the post-pass and to the checks.

pub mod error;
pub mod shader;

pub use error::Error;
