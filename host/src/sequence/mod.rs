//! The passes of a technique, frame by frame. A [`Sequence`] is what a technique gives to whoever drives it: a whole render or a session.
//!
//! ```
//! use restir_host::exec::Dispatches;
//! use restir_host::plan::Buffer;
//! use restir_host::sequence::{Frame, Stage};
//! use restir_host::technique::{Technique, path::PathSettings};
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let (size, features, arenas) = ([16, 16], scene.features, Buffer::arenas(&scene));
//! let dispatches = Dispatches::Short;
//! let stage = Stage { size, seed: 7, goes_on: false, most: 4, progressive: false, features, arenas, dispatches, share: None, given: None };
//! let mut sequence = PathSettings::default().sequence(&stage);
//!
//! sequence.begin(Frame {
//!     index: 0,
//!     samples: 4,
//!     camera: scene.camera.params(16, 16),
//!     last: None,
//!     scenes: [scene.header; 2],
//!     features,
//!     same_scene: true,
//!     primary_given: false,
//!     clears: true,
//!     adds: true,
//!     shows: true,
//! });
//! let mut kernels = Vec::new();
//! while let Some(pass) = sequence.next_pass() {
//!     kernels.push(pass?.kernel.name);
//! }
//! assert_eq!(kernels, ["path", "film_resolve"]);
//! # Ok::<(), Error>(())
//! ```

mod frames;
mod nested;
pub(crate) mod pixel_filter;
pub(crate) mod technique;

pub use frames::{Frame, Sequence, Share, Stage, Work};
pub(crate) use nested::Within;
