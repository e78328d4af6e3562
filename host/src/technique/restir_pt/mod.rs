//! Paths of any length by ReSTIR: every pixel traces a path, and neighbours share whole paths with each other (Lin et al. 2022, "Generalized
//! Resampled Importance Sampling", §7; Lin et al. 2026, "ReSTIR PT Enhanced").
//!
//! ```
//! use restir_host::render::{Render, render};
//! use restir_host::technique::restir_pt::PtSettings;
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//!
//! // the same frames, whose mean is the image, with and without neighbours
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let mean_with = |neighbours| -> Result<f32, Error> {
//!     let settings = PtSettings { max_depth: 3, neighbours, ..PtSettings::default() };
//!     let job = Render { count: 16, accumulate: true, ..Render::new([16, 16], settings) };
//!     let rendered = render(&mut CpuExecutor::new(None)?, &scene, &job, &mut |_| Ok(()))?;
//!     Ok(rendered.image.pixels.iter().map(|rgb| rgb[1]).sum::<f32>() / 256.0)
//! };
//! // both are estimates of the same image
//! let (alone, shared) = (mean_with(0)?, mean_with(4)?);
//! assert!(alone != shared && (alone - shared).abs() < 0.1 * alone);
//! # Ok::<(), Error>(())
//! ```

mod explain;
mod genealogy;
mod layers;
mod lineage;
mod plan;
mod settings;

pub use genealogy::{Generation, Offered, Reuse, genealogy};
pub use layers::{Layers, render_with_layers};
pub use lineage::Origin;
pub use settings::{Changed, Direct, Form, MAX_CONFIDENCE_CAP, MAX_DEPTH, MAX_SPATIAL_PASSES, PtSettings, Shift};

use super::{About, Integral, PixelFilter, Repeats, Technique};
use crate::exec::{Executor, Observer};
use crate::render::{Render, Rendered};
use crate::technique::explain::{Explanation, Subject};
use crate::technique::sequence::{Sequence, Stage};
use crate::{Error, buffers::SceneBuffers, image::Channel};
use restir_shared::layout::FEATURE_SUBSURFACE;

impl Technique for PtSettings {
    fn about(&self) -> &'static About {
        &About {
            name: "restir-pt",
            summary: "Paths of any length by resampling, over pixels and frames",
            repeats: Repeats::Frames,
            default_count: 16,
            // the first has no history
            settling: 1,
        }
    }

    fn sequence(&self, stage: &Stage) -> Box<dyn Sequence> {
        Box::new(plan::Chain::new(self, stage))
    }

    fn integral(&self) -> Integral {
        let Self { max_depth, jitter, multiscatter, .. } = *self;
        Integral { max_depth, jitter, filter: PixelFilter::Box, multiscatter }
    }

    fn check(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        self.check_together()?;
        if let Some(direct) = self.direct.technique(&self.integral()) {
            direct.check(scene, render)?;
        }
        scene.check_addresses()
    }

    fn advisable(&self) -> &'static [&'static str] {
        &["last,preset=quality", "last,preset=published", "preset=progressive"]
    }

    fn looks_back(&self) -> bool {
        self.temporal || self.direct.technique(&self.integral()).is_some_and(|direct| direct.looks_back())
    }

    fn reuses(&self) -> bool {
        self.temporal || self.shares() || self.direct.technique(&self.integral()).is_some_and(|direct| direct.reuses())
    }

    fn biases(&self) -> Vec<&'static str> {
        let stale = "where the scene changes, paths keep light that no longer arrives: it lags behind what moves";
        let own = (self.temporal && self.changed == Changed::Stale).then_some(stale);
        let direct = self.direct.technique(&self.integral()).map_or_else(Vec::new, |direct| direct.biases());
        own.into_iter().chain(direct).collect()
    }

    fn check_explained(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        genealogy::check(self, scene, render)
    }

    fn explain(&self, executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
        explain::explain(self, executor, subject)
    }

    fn render_with_layers(
        &self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        observe: &mut Observer<'_>,
    ) -> Result<(Rendered, Vec<Channel>), Error> {
        render_with_layers(executor, scene, render, observe).map(|(rendered, layers)| (rendered, layers.channels()))
    }

    fn leaves_out(&self, scene: &SceneBuffers) -> Option<&'static str> {
        (scene.features & FEATURE_SUBSURFACE != 0)
            .then_some("does not follow light inside of things that scatter it; the technique path does")
    }
}
