//! The techniques: what every pixel, or every element of a pass, computes.
//!
//! A technique is a set of functions over the traits of [`scene`](crate::scene), with one parameter block. The kernels of `restir-kernels`
//! call them on a device, and `restir-host` runs them in the right order; an embedder may do either. Techniques agree on the image:
//! [`path`] is the reference of the others.
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::glam::Vec3;
//! use restir_shared::layout::{CameraParams, FilmPixel};
//! use restir_shared::technique::path::{self, PathParams};
//! use restir_shared::technique::restir_di::{self, DiParams};
//!
//! // a pixel that sees the middle of the lit floor that the documentation of `scene` shows
//! let camera = CameraParams::pinhole(Vec3::new(0.0, 1.0, 0.1), Vec3::ZERO, Vec3::Z, 0.1, [1, 1]);
//! let traced = path::pixel(&Floor, &PathParams { max_depth: 2, ..PathParams::new(camera, [1, 1], 7) }, 0, 0);
//!
//! let params = DiParams::new(camera, [1, 1], 7);
//! let hit = restir_di::primary(&Floor, &params, [0, 0]);
//! let drawn = restir_di::initial(&Floor, &params, &[], hit, [0, 0]);
//! let resampled: FilmPixel = restir_di::shade(Floor, &params, hit, drawn.reservoir, drawn.direct, [0, 0]);
//! assert!((traced.sum[0] - resampled.sum[0]).abs() < 1e-3 && traced.sum[0] > 0.9);
//! ```

pub mod path;
pub mod restir_di;
pub mod restir_pt;
pub mod restir_sss;
pub mod restir_suffix;
