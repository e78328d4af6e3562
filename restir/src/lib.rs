//! ReSTIR and path tracing with the same bits on CPU and GPU, under one name.
//!
//! A [`scene::Scene`] is what you edit. It becomes [`buffers::SceneBuffers`], which kernels read. A [`render::Render`] makes a picture of it
//! with a [`technique`] on an executor ([`exec`]), and a [`session`] makes frame after frame in your own loop. [`prelude`] has the names that
//! most programs need.
//!
//! ```
//! use restir::prelude::*;
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 4, ..Render::new([16, 16], PathSettings::default()) };
//! let image = job.render(&scene, &mut CpuExecutor::new()?)?.image;
//!
//! // the mathematics is that of `restir-shared`, the kernels are those that ran
//! let middle = restir::shared::glam::Vec3::from_array(image.pixels[8 * 16 + 8]);
//! assert!(middle.min_element() > 0.0);
//! assert!(restir::kernels::all().iter().any(|kernel| kernel.name == "pt_trace"));
//! # Ok::<(), Error>(())
//! ```
//!
//! | what you want | where it is |
//! |---|---|
//! | pictures and frames of a scene | [`prelude`] |
//! | functions in your own renderer, on both sides | [`shared`], the crate `restir-shared` |
//! | kernels in your own pipelines | [`kernels`], the crate `restir-kernels`, and [`exec`] |
//! | files that can be continued, layers for denoisers, comparisons, your own scene's answers checked | [`advanced`] |
//!
//! The program is the crate `restir-cli`.

pub mod advanced;
pub mod prelude;

#[doc(inline)]
pub use restir_host::{Error, Shaders, buffers, denoise, exec, image, render, scene, session, technique};
pub use restir_kernels as kernels;
pub use restir_shared as shared;

#[cfg(feature = "gpu")]
pub use restir_host::wgpu;
