//! What programs around renders need: files that can be continued, layers for denoisers, comparisons, plans, scenes of other types.
//!
//! ```
//! use restir::advanced::metrics;
//! use restir::prelude::*;
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let mut cpu = CpuExecutor::new()?;
//! let job = Render::new([16, 16], PathSettings::default());
//! let one = job.render(&scene, &mut cpu)?.image;
//! let other = Render { seed: 1, ..job }.render(&scene, &mut cpu)?.image;
//! assert!(metrics::compare(&one, &other)?.rmse > 0.0);
//! # Ok::<(), Error>(())
//! ```

#[cfg(feature = "oidn")]
pub use restir_host::oidn;
#[cfg(feature = "exr")]
pub use restir_host::reference;
pub use restir_host::{
    aov, checkpoint, choices, error, foreign, input, memory, metrics, output, part, plan, replay, sequence, settings,
    tonemap, wide_bvh,
};
#[cfg(feature = "languages")]
pub use restir_host::{language, plan_file};
