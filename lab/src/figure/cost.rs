//! What a frame of ReSTIR DI asks of the scene.

use restir::technique::{asked::asked_after, restir_di::DiSettings};
use restir::{Error, buffers::SceneBuffers, render::Render};
use restir_kernels::restir_di::di_combine;

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
    pub(crate) fn of(scene: &SceneBuffers, size: [u32; 2], settings: &DiSettings) -> Result<Self, Error> {
        let render = Render { count: 1 + EARLIER, accumulate: true, ..Render::new(size, settings.clone()) };
        let share = 1.0 / (f64::from(size[0]) * f64::from(size[1]));
        let mut cost = Self::default();
        for (kernel, asked) in asked_after(scene, &render, EARLIER)?.into_iter().filter(|(_, asked)| asked.by_pixel) {
            let (rays, evaluations) = (asked.counts.shadow as f64 * share, asked.counts.light_samples as f64 * share);
            cost.shadow_rays += rays;
            cost.evaluations += evaluations;
            if kernel == di_combine::DESC.name {
                (cost.combine_rays, cost.combine_evaluations) = (rays, evaluations);
            }
        }
        Ok(cost)
    }
}
