//! Light under surfaces by ReSTIR: every pixel looks for points around the one where its path enters a body, and neighbours share them with their lights
//! (Werner et al. 2024, "ReSTIR Subsurface Scattering for Real-Time Path Tracing").
//!
//! ```
//! use restir_host::render::Render;
//! use restir_host::technique::restir_sss::{Shift, SssSettings};
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//!
//! // the same frames, whose mean is the image, by two shifts
//! let scene = SceneBuffers::build(&Scene::load("slab")?)?;
//! let mean_by = |shift| -> Result<f32, Error> {
//!     let settings = SssSettings { shift, ..SssSettings::default() };
//!     let job = Render { count: 16, accumulate: true, ..Render::new([16, 16], settings) };
//!     let rendered = job.render(&scene, &mut CpuExecutor::new()?)?;
//!     Ok(rendered.image.pixels.iter().map(|rgb| rgb[1]).sum::<f32>() / 256.0)
//! };
//! let (kept, replayed) = (mean_by(Shift::Reconnection)?, mean_by(Shift::Delayed)?);
//! assert!(kept != replayed && (kept - replayed).abs() < 0.1 * kept);
//! # Ok::<(), Error>(())
//! ```

mod describe;
mod plan;
mod settings;

pub use settings::{Shading, Shift, SssSettings, Traced};

use super::{
    About, Diagnose, Integral, PixelFilter, Repeats, Technique,
    inspect::{Inspect, Layered},
    reuse,
};
use crate::exec::{Executor, Observer};
use crate::render::Render;
use crate::settings::Settings;
use crate::technique::explain::{Explanation, Subject};
use crate::technique::sequence::{Sequence, Stage};
use crate::{Error, buffers::SceneBuffers, image::Channel};
use restir_shared::layout::FEATURE_SUBSURFACE;
use restir_shared::technique::restir_sss::PackedSubsurface;

impl Technique for SssSettings {
    fn about(&self) -> &'static About {
        &About {
            name: "restir-sss",
            summary: "Light under surfaces by resampling, over pixels and frames",
            repeats: Repeats::Frames,
            default_count: 16,
            // the first has no history
            settling: 1,
        }
    }

    fn sequence(&self, stage: &Stage) -> Box<dyn Sequence> {
        plan::sequence(self, stage)
    }

    fn integral(&self) -> Integral {
        let Self { max_depth, jitter, multiscatter, .. } = *self;
        Integral { max_depth, jitter, filter: PixelFilter::Box, multiscatter }
    }

    fn check(&self, scene: &SceneBuffers, _repeats: u32) -> Result<(), Error> {
        self.check_together()?;
        scene.check_addresses()
    }

    fn looks_back(&self) -> bool {
        self.temporal
    }
}

impl Diagnose for SssSettings {
    fn advisable(&self) -> &'static [&'static str] {
        &["last,preset=hybrid", "last,preset=reconnection", "preset=pathtracing"]
    }

    fn reuses(&self) -> bool {
        self.temporal || self.shares()
    }

    fn shown_by_path(&self) -> String {
        let path = self.path();
        let of = |key| format!("{key}={}", path.value(key).unwrap_or_default());
        let told = ["subsurface", "profile", "thickness", "lambert_below"].map(of).join(",");
        format!("{told},profile_paths=off")
    }

    fn differs_from_path(&self, scene: &SceneBuffers) -> Option<&'static str> {
        (scene.features & FEATURE_SUBSURFACE != 0).then_some(
            "has diffusion profiles for light under surfaces, as path has them with subsurface=diffusion,profile_paths=off",
        )
    }
}

impl Inspect for SssSettings {
    fn check_explained(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        reuse::check::<PackedSubsurface>(scene, render)
    }

    fn explain(&self, executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
        reuse::explain::explain::<PackedSubsurface>(executor, subject)
    }

    fn render_with_layers(
        &self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        observe: &mut Observer<'_>,
    ) -> Result<Layered<Vec<Channel>>, Error> {
        Ok(reuse::render_with_layers::<PackedSubsurface>(executor, scene, render, observe)?.into_channels())
    }
}
