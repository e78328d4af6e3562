//! Paths of any length by ReSTIR: every pixel traces a path, and neighbours share whole paths with each other (Lin et al. 2022, "Generalized
//! Resampled Importance Sampling", §7; Lin et al. 2026, "ReSTIR PT Enhanced").
//!
//! ```
//! use restir_host::render::Render;
//! use restir_host::technique::restir_pt::PtSettings;
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//!
//! // the same frames, whose mean is the image, with and without neighbours
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let mean_with = |neighbours| -> Result<f32, Error> {
//!     let settings = PtSettings { max_depth: 3, neighbours, ..PtSettings::default() };
//!     let job = Render { count: 16, accumulate: true, ..Render::new([16, 16], settings) };
//!     let rendered = job.render(&scene, &mut CpuExecutor::new()?)?;
//!     Ok(rendered.image.pixels.iter().map(|rgb| rgb[1]).sum::<f32>() / 256.0)
//! };
//! // both are estimates of the same image
//! let (alone, shared) = (mean_with(0)?, mean_with(4)?);
//! assert!(alone != shared && (alone - shared).abs() < 0.1 * alone);
//! # Ok::<(), Error>(())
//! ```

mod describe;
mod plan;
mod settings;

pub use crate::technique::reuse::{Form, Offered};
pub use settings::{Changed, PtSettings, Shift};
// the ends of ranges, which each setting names
#[doc(hidden)]
pub use settings::{MAX_CONFIDENCE_CAP, MAX_DEPTH, MAX_SPATIAL_PASSES};

use super::{
    About, Diagnose, Integral, PixelFilter, Repeats, Technique,
    inspect::{Inspect, Layered},
    reuse,
};
use crate::exec::{Executor, Observer};
use crate::render::Render;
use crate::technique::explain::{Explanation, Subject};
use crate::technique::sequence::{Sequence, Stage};
use crate::{Error, buffers::SceneBuffers, image::Channel};
use restir_shared::layout::FEATURE_SUBSURFACE;
use restir_shared::technique::restir_pt::PackedPath;

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
        Box::new(plan::chain(self, stage))
    }

    fn integral(&self) -> Integral {
        let Self { max_depth, jitter, multiscatter, .. } = *self;
        Integral { max_depth, jitter, filter: PixelFilter::Box, multiscatter }
    }

    fn check(&self, scene: &SceneBuffers, repeats: u32) -> Result<(), Error> {
        self.check_together()?;
        self.direct.check(&self.integral(), scene, repeats)?;
        scene.check_addresses()
    }

    fn looks_back(&self) -> bool {
        self.temporal || self.direct.looks_back(&self.integral())
    }
}

impl Diagnose for PtSettings {
    fn advisable(&self) -> &'static [&'static str] {
        &["last,preset=quality", "last,preset=published", "preset=progressive"]
    }

    fn reuses(&self) -> bool {
        self.temporal || self.shares() || self.direct.reuses(&self.integral())
    }

    fn biases(&self) -> Vec<&'static str> {
        let stale = "where the scene changes, paths keep light that no longer arrives: it lags behind what moves";
        let own = (self.temporal && self.changed == Changed::Stale).then_some(stale);
        own.into_iter().chain(self.direct.biases(&self.integral())).collect()
    }

    fn leaves_out(&self, scene: &SceneBuffers) -> Option<&'static str> {
        (scene.features & FEATURE_SUBSURFACE != 0)
            .then_some("does not follow light inside of things that scatter it; the technique path does")
    }
}

impl Inspect for PtSettings {
    fn check_explained(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        reuse::check::<PackedPath>(scene, render)
    }

    fn explain(&self, executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
        reuse::explain::explain::<PackedPath>(executor, subject)
    }

    fn render_with_layers(
        &self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        observe: &mut Observer<'_>,
    ) -> Result<Layered<Vec<Channel>>, Error> {
        Ok(reuse::render_with_layers::<PackedPath>(executor, scene, render, observe)?.into_channels())
    }
}
