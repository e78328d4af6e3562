//! A denoiser beside any technique: [`restir_shared::denoise`] after each frame that is shown, on the device that renders it.
//!
//! ```
//! use restir_host::denoise::Denoise;
//! use restir_host::render::Render;
//! use restir_host::technique::path::PathSettings;
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, metrics, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let noisy = Render { count: 4, ..Render::new([48, 48], PathSettings::default()) };
//! let denoised = Render { denoise: Some(Denoise::default()), ..noisy.clone() };
//! let reference = Render { count: 256, seed: 1, ..noisy.clone() };
//!
//! let mut cpu = CpuExecutor::new()?;
//! let [noisy, denoised, reference] = [noisy, denoised, reference].map(|job| job.render(&scene, &mut cpu));
//! let reference = reference?.image;
//! let [before, after] = [noisy?, denoised?].map(|of| metrics::compare(&of.image, &reference).expect("of a size").rel_mse);
//! assert!(after < 0.7 * before, "{after} of {before}");
//! # Ok::<(), Error>(())
//! ```

mod passes;
mod plan;

use crate::sequence::technique::Technique;
use crate::sequence::{Sequence, Stage};
use crate::settings;
pub(crate) use passes::Planes;
use plan::Denoised;
use restir_shared::denoise::DenoiseParams;
use restir_shared::num;

/// Most rounds: the pixels of the last one are 2^9 apart.
const MAX_ROUNDS: u32 = 10;

settings! {
    /// Settings of the denoiser.
    pub struct Denoise {
        /// Most frames that are averaged over time; 1 turns it off. Frames that reuse samples have most of their error in common, so that more
        /// of them help little, and those before them have more.
        history: u32 = 8, in 1..=1024, unit "frames";
        /// Rounds of the filter, each of which reaches twice as far; 0 averages over time alone.
        rounds: u32 = 5, in 0..=MAX_ROUNDS, unit "";
        /// Neighbours whose luminance differs by so many standard deviations see other light; in each further round half as many do. In the first
        /// one a sample that has found a lamp is far from neighbours that have not.
        deviations: f32 = 40.0, in 0.1..=1000.0, unit "standard deviations";
    }
}

impl Denoise {
    /// The parameters of an image that is a mean of so many samples: fewer are far from the mean of many. That a sample which finds a lamp
    /// differs by many deviations is less so of means. The fourth root is a choice: without it means of many are blurred, and with the square
    /// root what is left of rare samples stays.
    pub(crate) fn params(&self, [width, height]: [u32; 2], samples: u32, mean: DenoiseParams) -> DenoiseParams {
        let deviations = self.deviations / num::sqrt(num::sqrt(samples.max(1) as f32));
        DenoiseParams { width, height, deviations, ..mean }
    }
}

/// The frames of a technique, denoised if that is wanted.
pub(crate) fn sequence(technique: &dyn Technique, denoise: Option<&Denoise>, stage: &Stage) -> Box<dyn Sequence> {
    match denoise {
        Some(denoise) => Box::new(Denoised::new(denoise.clone(), technique, stage)),
        None => technique.sequence(stage),
    }
}
