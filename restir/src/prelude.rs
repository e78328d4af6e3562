//! The names that most programs need.
//!
//! ```
//! use restir::prelude::*;
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let setup = Setup::new(scene, DiSettings::default(), [16, 16]);
//! let mut session = CpuSession::new(setup, CpuExecutor::new()?)?;
//! session.frame(&View::default())?;
//! assert!(session.pixels().iter().all(|pixel| pixel.sum[1].is_finite()));
//! # Ok::<(), Error>(())
//! ```

#[cfg(feature = "gpu")]
pub use restir_host::exec::GpuExecutor;
#[cfg(feature = "exr")]
pub use restir_host::image::{read_exr, write_exr};
#[cfg(feature = "gpu")]
pub use restir_host::session::GpuSession;
pub use restir_host::{
    Error, Shaders,
    buffers::SceneBuffers,
    exec::{CpuExecutor, Executor, Flavour},
    image::Image,
    render::{Images, Render, Rendered, Shows},
    scene::{Camera, Scene},
    session::{CpuSession, SceneChange, Setup, View},
    technique::{Technique, path::PathSettings, restir_di::DiSettings, restir_pt::PtSettings},
};
