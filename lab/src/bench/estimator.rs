//! What a sample of a technique asks of the scene, on average.

use std::collections::BTreeMap;

use restir::technique::asked::{Asked, asked_after};
use restir::{Error, buffers::SceneBuffers, render::Render};

/// Rays are counted over about this many pixels ...
const COUNTED_PIXELS: u32 = 2048;
/// ... and this many samples or frames of each, after those that settle.
const COUNTED_REPEATS: u32 = 4;

/// How often a sample of a pixel asks each question.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PerSample {
    pub(crate) closest: f64,
    pub(crate) shadow: f64,
    pub(crate) surfaces: f64,
    pub(crate) light_samples: f64,
}

impl PerSample {
    pub(crate) fn rays(&self) -> f64 {
        self.closest + self.shadow
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            closest: self.closest + other.closest,
            shadow: self.shadow + other.shadow,
            surfaces: self.surfaces + other.surfaces,
            light_samples: self.light_samples + other.light_samples,
        }
    }
}

/// Counts natively, kernel by kernel, in a smaller image: what is measured is not burdened. What all pixels share is
/// shared by those of the image itself.
///
/// # Errors
/// As of [`Render::check`].
pub(crate) fn per_sample(scene: &SceneBuffers, render: &Render) -> Result<BTreeMap<&'static str, PerSample>, Error> {
    let pixels = f64::from(render.width) * f64::from(render.height);
    let shrink = (f64::from(COUNTED_PIXELS) / pixels).sqrt().min(1.0);
    let side = |side: u32| ((f64::from(side) * shrink) as u32).max(1);
    let (width, height, settling) = (side(render.width), side(render.height), render.technique.about().settling);
    let smaller = Render { width, height, count: settling + COUNTED_REPEATS, accumulate: true, ..render.clone() };
    let share = |Asked { counts, by_pixel }: Asked| {
        let of = if by_pixel { f64::from(width) * f64::from(height) } else { pixels };
        let share = |count: u64| count as f64 / (of * f64::from(COUNTED_REPEATS));
        PerSample {
            closest: share(counts.closest),
            shadow: share(counts.shadow),
            surfaces: share(counts.surfaces),
            light_samples: share(counts.light_samples),
        }
    };
    let kernels = asked_after(scene, &smaller, settling)?;
    Ok(kernels.into_iter().map(|(kernel, asked)| (kernel, share(asked))).collect())
}
