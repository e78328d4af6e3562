//! Path tracing, ReSTIR DI and ReSTIR PT (reuse of light samples and of whole paths between pixels and frames), and subsurface scattering, as functions
//! of one pixel that are written once for CPU and GPU.
//!
//! The crate is `no_std` without `alloc`. It compiles natively on stable Rust and, by rust-gpu, to SPIR-V;
//! both give the same bits, because everything is built from the operations that IEEE 754 and Vulkan fix
//! (see DETERMINISM.md in the repository).
//!
//! A renderer that brings its own scene implements the traits of [`scene`], as far as the technique of its choice asks for them, and calls
//! that technique's functions once a pixel. What these are made of is public, too: samplers, scattering functions,
//! reservoirs, shifts.
//!
//! | what you want | where it is |
//! |---|---|
//! | direct light from many lights, with reuse | [`technique::restir_di`], with the passes of a frame as a program |
//! | whole paths, with reuse | [`technique::restir_pt`] |
//! | a path tracer, also under surfaces | [`technique::path`] |
//! | your own scene | [`scene`]: what has to be answered, and two scenes to begin from |
//! | your own material | [`bsdf::ScatteringFunction`] |
//! | a check of your scene's answers | `foreign::check` of the crate `restir-host` |
//!
//! Take vectors from [`restir_shared::glam`](glam), so that they have this crate's version of it.
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! use restir_shared::glam::Vec3;
//! use restir_shared::layout::CameraParams;
//! use restir_shared::technique::path::{self, PathParams};
//!
//! // `Floor` is the scene that the documentation of the module `scene` shows: a grey floor under a lamp
//! let scene = floor::Floor;
//! let camera = CameraParams::pinhole(Vec3::Y, Vec3::ZERO, Vec3::Z, 0.1, [1, 1]);
//! let params = PathParams { max_depth: 2, ..PathParams::new(camera, [1, 1], 7) };
//!
//! // one sample of the only pixel, which sees the point below the lamp
//! let pixel = path::pixel(&scene, &params, 0, 0);
//! assert!((pixel.sum[0] - 1.0).abs() < 1e-3 && pixel.dropped == 0.0);
//! ```
//!
//! The modules are listed leaf first: a module uses only those above it. What this documentation hides is what kernels and the crate
//! `restir-host` share beside that: words of buffers, steps of passes, functions for many lanes at once. It may change with any version.
//!
//! | module | purpose |
//! |---|---|
//! | [`num`] | the only home of non-trivial scalar functions: division, roots, exponentials, angles |
//! | [`vec`] | dot, cross, length, normalisation and frames in a fixed order of evaluation |
//! | [`color`] | luminance, the sRGB transfer function |
//! | [`rng`] | counter-based random numbers keyed by (pixel, sample, dimension, seed) |
//! | [`layout`] | the plain-data types that cross the bus between host and device |
//! | [`sampling`] | `sample_x`, `x_pdf` and `invert_x` for each distribution |
//! | [`medium`] | media that scatter and absorb light |
//! | [`geometry`] | rays, the watertight triangle test, BVH traversal |
//! | [`bsdf`] | scattering functions |
//! | [`scene`] | the traits an embedder implements, and [`scene::SceneView`], which implements all of them |
//! | [`camera`] | the pinhole and the thin-lens camera |
//! | [`transport`] | vertices of paths, their connections, straight ways through glass |
//! | [`resample`] | reservoirs, and how several become one |
//! | [`shift`] | how paths move from pixel to pixel, and their Jacobians |
//! | [`technique`] | the per-pixel bodies |
#![no_std]
// on a device two functions read and write memory of the workgroup, for which Rust has no word
#![cfg_attr(not(target_arch = "spirv"), forbid(unsafe_code))]
#![cfg_attr(target_arch = "spirv", feature(asm_experimental_arch))]

pub use glam;

pub mod bsdf;
pub mod camera;
pub mod color;
#[doc(hidden)]
pub mod compact;
#[doc(hidden)]
pub mod conditional;
#[doc(hidden)]
pub mod denoise;
#[doc(hidden)]
pub mod diffusion;
#[doc(hidden)]
pub mod film;
pub mod geometry;
#[cfg(not(target_arch = "spirv"))]
#[doc(hidden)]
pub mod lanes;
pub mod layout;
pub mod medium;
pub mod num;
#[doc(hidden)]
pub mod pack;
pub mod resample;
pub mod rng;
pub mod sampling;
pub mod scene;
pub mod shift;
pub mod technique;
pub mod transport;
pub mod vec;
