//! Direct light by ReSTIR: frames that reuse each other's reservoirs.

mod explain;
mod genealogy;
mod layers;
mod lineage;
mod moments;
mod plan;
mod settings;
mod shading;

pub use genealogy::{Generation, LightSource, Reuse, genealogy};
pub use layers::{Layers, render_with_layers};
pub use lineage::Origin;
pub use settings::{
    DiSettings, MAX_CANDIDATES, MAX_CONFIDENCE_CAP, MAX_NEIGHBOURS, MAX_SHADED, MAX_SPATIAL_PASSES, MAX_TILE_SIZE,
    MAX_TILES, Target, Temporal, Tiles, Visibility, VisibilityReuse,
};

use super::{About, Integral, Repeats, Technique};
use crate::Error;
use crate::buffers::SceneBuffers;
use crate::exec::Executor;
use crate::image::Channel;
use crate::plan::FramePlan;
use crate::render::{Progress, Render, Rendered};
use crate::scene::Scene;
use crate::technique::explain::{Explanation, Place};
use restir_shared::layout::FEATURE_CLEAR;
use restir_shared::scene::LightAddress;
use std::ops::ControlFlow;

/// Paths of so many segments carry direct light and what is seen to emit.
const DEPTH: u32 = 2;

impl Technique for DiSettings {
    fn about(&self) -> &'static About {
        &About {
            name: "restir-di",
            summary: "Direct light by resampling, over frames",
            repeats: Repeats::Frames,
            default_count: 16,
            // the first has no history, and both find hits for their plane
            settling: 2,
        }
    }

    fn plan<'a>(&'a self, scene: &'a SceneBuffers, render: &'a Render) -> FramePlan<'a> {
        plan::plan(self, scene, render)
    }

    fn integral(&self) -> Integral {
        Integral { max_depth: DEPTH, jitter: self.jitter }
    }

    fn check(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        self.check_together()?;
        let problem = if plan::film_samples(self, render) > u64::from(u32::MAX) {
            format!(
                "{} frames of {} passes of shading are too many; give fewer frames, or a smaller setting shaded",
                render.count,
                self.shading_passes()
            )
        } else if scene.most_lights() >= LightAddress::NO_LIGHT {
            format!(
                "the scene has {} lights and reservoirs know at most {}; use another technique",
                scene.most_lights(),
                LightAddress::NO_LIGHT - 1
            )
        } else {
            return Ok(());
        };
        Err(Error::Setting(problem))
    }

    fn reuses(&self) -> bool {
        self.temporal != Temporal::Off || self.spatial > 0 || self.shaded > 0
    }

    fn biases(&self) -> Vec<&'static str> {
        self.reasons_for_bias()
    }

    fn differs_from_path(&self, scene: &SceneBuffers) -> Option<&'static str> {
        (self.transmittance && scene.features & FEATURE_CLEAR != 0)
            .then_some("sees lights through clear glass, and path tracing does not; give transmittance=off")
    }

    fn check_explained(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        genealogy::check(self, scene, render)
    }

    fn explain(
        &self,
        executor: &mut dyn Executor,
        scene: (&Scene, &SceneBuffers),
        render: &Render,
        place: Place,
    ) -> Result<Explanation, Error> {
        explain::explain(self, executor, scene, render, place)
    }

    fn render_with_layers(
        &self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        observe: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<(Rendered, Vec<Channel>), Error> {
        render_with_layers(executor, scene, render, observe).map(|(rendered, layers)| (rendered, layers.channels()))
    }
}
