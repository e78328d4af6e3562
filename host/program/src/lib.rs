//! ReSTIR and path tracing with the same bits on CPU and GPU, under one name.
//!
//! This crate is the program `restir`, and what an embedder needs: the modules of [`restir_host`] (scenes, plans,
//! executors, images, references) beside [`shared`], the mathematics that runs on both sides, and [`kernels`], the entry
//! points. `default-features = false` leaves the program and what only it needs out; `gpu` adds the wgpu executor.

pub use restir_host::*;
pub use restir_kernels as kernels;
pub use restir_shared as shared;
