//! Suffixes of paths by resampling, and a final gather.

mod plan;
mod settings;

pub use settings::{Canonical, SuffixSettings};

use super::inspect::Inspect;
use super::{About, Diagnose, Integral, PixelFilter, Repeats, Technique};
use crate::technique::sequence::{Sequence, Stage};
use crate::{Error, buffers::SceneBuffers};
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

    fn check(&self, scene: &SceneBuffers, _repeats: u32) -> Result<(), Error> {
        scene.check_addresses()
    }

    fn looks_back(&self) -> bool {
        self.temporal
    }
}

impl Diagnose for SuffixSettings {
    fn advisable(&self) -> &'static [&'static str] {
        &[]
    }

    fn reuses(&self) -> bool {
        true
    }

    fn leaves_out(&self, scene: &SceneBuffers) -> Option<&'static str> {
        (scene.features & FEATURE_SUBSURFACE != 0)
            .then_some("does not follow light inside of things that scatter it; the technique path does")
    }
}

impl Inspect for SuffixSettings {}
