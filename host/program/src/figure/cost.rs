//! What a frame of ReSTIR DI asks of the scene, counted pass by pass.

use restir::buffers::SceneBuffers;
use restir::di::{DiRender, DiSettings};
use restir::replay::{Counts, Frames, Recording};
use restir_kernels as kernels;
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
    pub(crate) fn of(scene: &SceneBuffers, size: [u32; 2], settings: &DiSettings) -> Self {
        let view = scene.view();
        let recording = Recording::new(&view);
        let render = DiRender { frames: 1 + EARLIER, accumulate: true, ..DiRender::new(size, settings.clone()) };
        let (mut all, mut combines) = (Counts::default(), Counts::default());
        Frames::replay(&recording, scene, &render, &mut |pass, _| {
            let counts = recording.take_counts();
            let is_frame = |p: &[DiParams]| p.iter().any(|p| p.frame == EARLIER);
            if !bytemuck::try_cast_slice(&pass.params).is_ok_and(is_frame) {
                return;
            }
            all = all.plus(counts);
            if pass.kernel.name == kernels::di::di_combine::DESC.name {
                combines = combines.plus(counts);
            }
        });
        let share = 1.0 / (f64::from(size[0]) * f64::from(size[1]));
        Self {
            shadow_rays: all.shadow as f64 * share,
            combine_rays: combines.shadow as f64 * share,
            evaluations: all.light_samples as f64 * share,
            combine_evaluations: combines.light_samples as f64 * share,
        }
    }
}
