//! Direct light by ReSTIR: frames that reuse each other's reservoirs.
//!
//! ```
//! use restir_host::render::Render;
//! use restir_host::technique::Diagnose;
//! use restir_host::technique::restir_di::DiSettings;
//! use restir_host::technique::reuse::render_with_layers;
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//! use restir_shared::technique::restir_di::PackedReservoir;
//!
//! let settings = DiSettings::preset("quality").expect("a preset");
//! assert!(settings.biases().is_empty());
//!
//! // eight frames, of which each reuses what the ones before it have found
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 8, ..Render::new([32, 24], settings) };
//! let mut cpu = CpuExecutor::new()?;
//! let layered = render_with_layers::<PackedReservoir>(&mut cpu, &scene, &job, &mut |_| Ok(()))?;
//! assert_eq!(layered.rendered.dropped_samples, 0);
//! // the reservoirs of the last frame stand for more than the candidates of one
//! assert!(layered.layers.records.iter().any(|reservoir| reservoir.confidence > 4.0));
//! # Ok::<(), Error>(())
//! ```

mod describe;
mod plan;
mod settings;
mod shading;

pub use describe::{LightSource, SampleDetails};
pub use settings::{DiSettings, Target, Temporal, Tiles, Visibility, VisibilityReuse};
// the ends of ranges, which each setting names
#[doc(hidden)]
pub use settings::{
    MAX_CANDIDATES, MAX_CONFIDENCE_CAP, MAX_INITIAL_RAYS, MAX_NEIGHBOURS, MAX_SHADED, MAX_SPATIAL_PASSES,
    MAX_TILE_SIZE, MAX_TILES,
};

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
use restir_shared::layout::{FEATURE_CLEAR, FEATURE_SUBSURFACE};
use restir_shared::technique::restir_di::PackedReservoir;

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

    fn sequence(&self, stage: &Stage) -> Box<dyn Sequence> {
        Box::new(plan::chain(self, stage))
    }

    fn looks_back(&self) -> bool {
        self.temporal != Temporal::Off
    }

    fn integral(&self) -> Integral {
        let Self { jitter, multiscatter, .. } = *self;
        Integral { max_depth: DEPTH, jitter, filter: PixelFilter::Box, multiscatter }
    }

    fn check(&self, scene: &SceneBuffers, repeats: u32) -> Result<(), Error> {
        self.check_together()?;
        let passes = self.shading_passes();
        if u64::from(repeats) * u64::from(passes) > u64::from(u32::MAX) {
            let problem = format!(
                "{repeats} frames of {passes} passes of shading are too many; give fewer frames, or a smaller setting shaded"
            );
            return Err(Error::ConflictingSettings { settings: &["frames", "shaded"], problem });
        }
        scene.check_addresses()
    }

    /// Light through clear glass is a longer path.
    fn for_direct_light(&self, integral: &Integral) -> Option<Box<dyn Technique>> {
        let Integral { jitter, multiscatter, .. } = *integral;
        let settings = Self { jitter, multiscatter, transmittance: false, ..self.clone() };
        let differs = settings.integral() != Integral { max_depth: DEPTH, ..*integral };
        (!differs).then(|| settings.into())
    }
}

impl Diagnose for DiSettings {
    /// Without reuse, then the unbiased presets for one frame after the other and for the mean of all, of which the latter with more
    /// candidates pays where there are hundreds of lights, and with a spatial pass where there are so many that most pixels find
    /// nothing of use by themselves.
    fn advisable(&self) -> &'static [&'static str] {
        &[
            "temporal=off,spatial=0,shaded=0,scatter=off,candidates=32",
            "last,preset=fast",
            "last,preset=quality",
            "last,preset=offline",
            "preset=progressive",
            "preset=progressive,candidates=128",
            "preset=progressive,candidates=128,spatial=1,shaded=16,shading_radius=3",
        ]
    }

    fn without_effect(&self, scene: &SceneBuffers) -> Option<String> {
        let _ = scene;
        let idle = !self.jitter && self.seen_rays > 1;
        idle.then(|| {
            "has no use for seen_rays without jitter: all rays are those through the centres of pixels".to_owned()
        })
    }

    fn reuses(&self) -> bool {
        self.temporal != Temporal::Off || self.spatial > 0 || self.shaded > 0
    }

    fn biases(&self) -> Vec<&'static str> {
        self.reasons_for_bias()
    }

    fn leaves_out(&self, scene: &SceneBuffers) -> Option<&'static str> {
        (scene.features & FEATURE_SUBSURFACE != 0)
            .then_some("does not follow light inside of things that scatter it; the technique path does")
    }

    fn differs_from_path(&self, scene: &SceneBuffers) -> Option<&'static str> {
        let clear = self.transmittance && scene.features & FEATURE_CLEAR != 0;
        let through = "sees lights through clear glass, and path tracing does not; give transmittance=off";
        self.leaves_out(scene).or(clear.then_some(through))
    }
}

impl Inspect for DiSettings {
    fn check_explained(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        reuse::check::<PackedReservoir>(scene, render)
    }

    fn explain(&self, executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
        reuse::explain::explain::<PackedReservoir>(executor, subject)
    }

    fn render_with_layers(
        &self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        observe: &mut Observer<'_>,
    ) -> Result<Layered<Vec<Channel>>, Error> {
        Ok(reuse::render_with_layers::<PackedReservoir>(executor, scene, render, observe)?.into_channels())
    }
}
