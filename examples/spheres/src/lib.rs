//! A renderer of its own scene, whose shaders are built of `restir-shared`.
//!
//! [`scene`] answers what the library asks, [`kernels`] are a few lines a kernel around the library's functions, and `native` describes
//! them to the library's executors, which a renderer with pipelines of its own does not need. `docs/own-shader.md` is the page about it.
#![cfg_attr(target_arch = "spirv", no_std)]

pub mod kernels;
#[cfg(not(target_arch = "spirv"))]
pub mod native;
pub mod scene;
