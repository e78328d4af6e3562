//! What a frame of ReSTIR DI asks of the scene, counted pass by pass.

use restir::Error;
use restir::buffers::SceneBuffers;
use restir::di::{self, DiRender, DiSettings};
use restir::replay::{self, Counts, Recording};
use restir_kernels::di::di_combine;
use restir_shared::technique::di::DiParams;

/// Frames before the one that is counted, which give it a history: rays do not depend on how long that is, only on what
/// is occluded.
const EARLIER: u32 = 5;

/// Of a frame with a history, a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cost {
    /// Shadow rays in all.
    pub(crate) shadow_rays: f64,
    /// Those of the combines alone.
    pub(crate) combine_rays: f64,
    /// Targets evaluated in all: lights at an address, candidates among them unless they are from tiles.
    pub(crate) evaluations: f64,
    /// Those of the combines alone.
    pub(crate) combine_evaluations: f64,
}

impl Cost {
    /// Counts natively; `scene` stands still.
    ///
    /// # Errors
    /// As of [`replay::run`].
    pub(crate) fn of(scene: &SceneBuffers, size: [u32; 2], settings: &DiSettings) -> Result<Self, Error> {
        let view = scene.view();
        let recording = Recording::new(&view);
        let render = DiRender { frames: 1 + EARLIER, accumulate: true, ..DiRender::new(size, settings.clone()) };
        let (mut all, mut combines) = (Counts::default(), Counts::default());
        replay::run(&recording, di::plan(scene, &render), &mut |step| {
            let counts = recording.take_counts();
            if step.pass.params::<DiParams>().is_some_and(|p| p.frame == EARLIER) {
                all = all.plus(counts);
                if step.pass.kernel.name == di_combine::DESC.name {
                    combines = combines.plus(counts);
                }
            }
            Ok(())
        })?;
        let share = 1.0 / (f64::from(size[0]) * f64::from(size[1]));
        Ok(Self {
            shadow_rays: all.shadow as f64 * share,
            combine_rays: combines.shadow as f64 * share,
            evaluations: all.light_samples as f64 * share,
            combine_evaluations: combines.light_samples as f64 * share,
        })
    }
}
