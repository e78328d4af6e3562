//! ReSTIR and path tracing with the same bits on CPU and GPU, under one name.
//!
//! This crate has what an embedder needs: the modules of [`restir_host`] (scenes, plans, executors, images, references) beside
//! [`shared`], the mathematics that runs on both sides, and [`kernels`], the entry points. The program is the crate `restir-cli`.
//!
//! ```
//! use restir::render::{Render, render};
//! use restir::{buffers::SceneBuffers, exec::CpuExecutor, scene::Scene, technique::path::PathSettings};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let picture = Render { count: 4, ..Render::new([16, 16], PathSettings::default()) };
//! let image = render(&mut CpuExecutor::new(None)?, &scene, &picture, &mut |_| Ok(()))?.image;
//!
//! // the mathematics is that of `restir-shared`, the kernels are those that ran
//! let middle = restir::shared::glam::Vec3::from_array(image.pixels[8 * 16 + 8]);
//! assert!(middle.min_element() > 0.0);
//! assert!(restir::kernels::all().iter().any(|kernel| kernel.name == "pt_trace"));
//! # Ok::<(), restir::Error>(())
//! ```

pub use restir_host::*;
pub use restir_kernels as kernels;
pub use restir_shared as shared;
