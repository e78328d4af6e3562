//! The project's own tools, behind `cargo xtask`.
//!
//! It is a library too, so that integration tests can feed modules to the post-pass and to the checks.

pub mod albedo;
pub mod aov;
mod compiled_out;
pub mod crossings;
pub mod diffusion;
pub mod documented;
pub mod error;
pub mod features;
mod fit;
pub mod furnace;
pub mod gains;
pub mod mutate;
pub mod num;
pub mod package;
pub mod parity;
pub mod passes;
mod process;
pub mod profile;
mod report;
pub mod resampling;
pub mod reuse;
pub mod searchlight;
pub mod session;
pub mod shader;
pub mod shifts;
pub mod stress;
mod time;
pub mod unbiased;
pub mod visibility;
pub mod walks;
pub mod watertight;

pub use error::Error;
