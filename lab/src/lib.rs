//! The laboratory: experiments, benchmarks and figures of papers, behind `cargo lab`, and the statistics that they need.
//!
//! A module lives with those who use it: what an embedder calls is in `restir-host`, what commands of the program `restir` need beside
//! that is in `restir-cli`, and what only reports in `docs` need is here. This crate is not published, and no published one depends on it.
#![allow(missing_debug_implementations, reason = "options of commands, which nothing prints")]

pub mod albedo;
pub mod aov;
pub mod bench;
pub mod bootstrap;
mod compiled_out;
pub mod correlation;
pub mod crossings;
pub mod denoised;
pub mod device;
pub mod diffusion;
pub mod error;
pub mod features;
pub mod figure;
mod fit;
pub mod flip;
pub mod furnace;
pub mod gains;
pub mod num;
mod origin;
pub mod parity;
pub mod passes;
pub mod probe;
pub mod profile;
mod report;
pub mod resampling;
pub mod reuse;
pub mod searchlight;
pub mod session;
pub mod shifts;
pub mod simd;
pub mod stress;
mod time;
pub mod unbiased;
pub mod visibility;
pub mod walks;
pub mod watertight;

pub use error::Error;
