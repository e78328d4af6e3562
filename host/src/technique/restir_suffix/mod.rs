//! Suffixes of paths by resampling, and a final gather: every pixel keeps the far part of a path, and new prefixes borrow what ends near them
//! (Kettunen et al. 2023, "Conditional Resampled Importance Sampling and ReSTIR").
//!
//! ```
//! use restir_host::render::Render;
//! use restir_host::technique::restir_suffix::SuffixSettings;
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//!
//! // the same frames, whose mean is the image, with one integration prefix a pixel and with eight
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let mean_with = |prefixes| -> Result<f32, Error> {
//!     let settings = SuffixSettings { max_depth: 3, prefixes, ..SuffixSettings::default() };
//!     let job = Render { count: 16, accumulate: true, ..Render::new([16, 16], settings) };
//!     let rendered = job.render(&scene, &mut CpuExecutor::new()?)?;
//!     Ok(rendered.image.pixels.iter().map(|rgb| rgb[1]).sum::<f32>() / 256.0)
//! };
//! let (one, eight) = (mean_with(1)?, mean_with(8)?);
//! assert!(one != eight && (one - eight).abs() < 0.1 * one);
//! # Ok::<(), Error>(())
//! ```

mod explain;
mod plan;
mod settings;

pub use settings::SuffixSettings;

use super::explain::{Explanation, Subject};
use super::inspect::Inspect;
use super::{About, Diagnose, Integral, PixelFilter, Repeats, Technique};
use crate::technique::sequence::{Sequence, Stage};
use crate::{Error, buffers::SceneBuffers, exec::Executor};
use restir_shared::layout::FEATURE_SUBSURFACE;

impl Technique for SuffixSettings {
    fn about(&self) -> &'static About {
        &About {
            name: "restir-suffix",
            summary: "Suffixes of paths by resampling, gathered from many prefixes",
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
        self.direct.check(&self.integral(), scene, repeats)?;
        scene.check_addresses()
    }

    fn looks_back(&self) -> bool {
        self.temporal || self.direct.looks_back(&self.integral())
    }
}

impl Diagnose for SuffixSettings {
    fn advisable(&self) -> &'static [&'static str] {
        &[]
    }

    fn reuses(&self) -> bool {
        true
    }

    fn biases(&self) -> Vec<&'static str> {
        self.direct.biases(&self.integral())
    }

    fn leaves_out(&self, scene: &SceneBuffers) -> Option<&'static str> {
        (scene.features & FEATURE_SUBSURFACE != 0)
            .then_some("does not follow light inside of things that scatter it; the technique path does")
    }
}

impl Inspect for SuffixSettings {
    fn explain(&self, executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
        explain::explain(executor, subject)
    }
}
