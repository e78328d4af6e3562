//! Scenes that native replays run over ([`CpuExecutor::run_over`](crate::exec::CpuExecutor::run_over)): [`Recording`] writes down what it is
//! asked, and what the answer was.
//!
//! ```
//! use restir_host::replay::{Event, Recording};
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//! use restir_shared::geometry::Ray;
//! use restir_shared::glam::Vec3;
//! use restir_shared::rng::{Rng, Sampler};
//! use restir_shared::technique::path::radiance;
//!
//! let buffers = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let view = buffers.view();
//! let recording = Recording::new(&view);
//! // one path of two segments, whose first one ends inside of the box
//! let camera = buffers.camera.params(1, 1);
//! let direction = Vec3::from_array(camera.forward).normalize();
//! let ray = Ray { origin: Vec3::from_array(camera.position), direction, t_max: Ray::FAR, key: 0 };
//! radiance(&recording, ray, &Rng::new(0, 0, 0, 7, Sampler::Sobol), 2, false);
//!
//! let counts = recording.counts();
//! assert!((1..=2).contains(&counts.closest) && counts.shadow <= 1 && counts.surfaces >= 1);
//! assert!(matches!(recording.into_events()[0], Event::Closest { hit, .. } if hit.is_hit()));
//! # Ok::<(), Error>(())
//! ```

mod recording;
mod two_frames;

pub use recording::{Counts, Event, Recording};
pub(crate) use two_frames::TwoFrames;
