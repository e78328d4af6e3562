//! What a technique shows of how its images come about.
//!
//! ```
//! use restir_host::exec::CpuExecutor;
//! use restir_host::render::Render;
//! use restir_host::technique::explain::{Place, Subject};
//! use restir_host::technique::{inspect::Inspect, restir_di::DiSettings};
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//!
//! let scene = Scene::load("cornell")?;
//! let buffers = SceneBuffers::build(&scene)?;
//! let job = Render { count: 2, ..Render::new([16, 16], DiSettings::default()) };
//! let inspect: &dyn Inspect = job.technique.inspect();
//! inspect.check_explained(&buffers, &job)?;
//! let subject = Subject { scene: &scene, buffers: &buffers, render: &job, place: Place { x: 8, y: 8, sample: 0 } };
//! assert!(inspect.explain(&mut CpuExecutor::new()?, subject)?.text.contains("pixel (8, 8)"));
//! # Ok::<(), Error>(())
//! ```

use super::explain::{self, Explanation, Subject};
use crate::exec::{Executor, Observer};
use crate::render::{Render, Rendered};
use crate::{Error, buffers::SceneBuffers, image::Channel};

/// A render with what was held beside its image: as channels of a file, or of one technique as its records
/// ([`Layers`](super::reuse::Layers)).
#[derive(Clone, Debug)]
pub struct Layered<L> {
    /// The render.
    pub rendered: Rendered,
    /// What was held after its last pass.
    pub layers: L,
}

/// Explains and shows renders of a technique. What is not written for it is what every technique has.
pub trait Inspect {
    /// Explains one pixel of a render. What is printed by default is what every pass reads and writes there, replayed
    /// natively and compared with the executor.
    ///
    /// # Errors
    /// As of [`Render::render`], and for a place outside of the image.
    fn explain(&self, executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
        explain::passes(executor, subject)
    }

    /// Whether [`Self::explain`] can be done, before a device is opened for it.
    ///
    /// # Errors
    /// As of [`Render::check`].
    fn check_explained(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        render.check(scene)
    }

    /// Renders, and gives further channels that show what the technique holds after its last pass.
    ///
    /// # Errors
    /// As of [`Render::render`]; [`Error::NoLayers`] if the technique has nothing to show.
    fn render_with_layers(
        &self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        observe: &mut Observer<'_>,
    ) -> Result<Layered<Vec<Channel>>, Error> {
        let _ = (executor, scene, observe);
        let reason = "it holds nothing beside the image";
        Err(Error::NoLayers { technique: render.technique.about().name, reason })
    }
}

/// What every technique has.
pub(super) struct Plain;

impl Inspect for Plain {}
