//! What the errors of frames have in common.

use crate::correlation::Errors;
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::image::Image;
use restir_host::render::{Images, Render, Shows};
use restir_host::technique::path::PathSettings;
use restir_host::technique::restir_pt::PtSettings;
use restir_host::technique::reuse::render_with_layers;
use restir_shared::rng::Sampler;
use restir_shared::technique::restir_pt::PackedPath;

use super::{FRAMES, study};

/// Samples of path tracing in place of a frame.
pub(super) const SAMPLES: u32 = 16;
/// Independent chains.
const CHAINS: u32 = 3;
/// Pixels at this distance still count as neighbours.
const REACH: i32 = 8;
/// Errors are limited to so many times the root of what relMSE divides by: a few bright pixels would be all that counts.
const LARGEST: f64 = 3.0;
/// The part of the squared mean in what relMSE divides by.
const DARK: f64 = 0.01;

/// What the frames of some settings have in common, means over chains.
pub(super) struct Correlated {
    /// The technique and its settings; nothing of path tracing.
    pub(super) settings: Option<(&'static str, &'static str)>,
    /// The largest correlation of the errors of neighbours within the reach.
    pub(super) over_pixels: f64,
    /// The correlation of a pixel's errors in a frame and the next one.
    pub(super) over_time: f64,
    /// How much larger the variance of a mean of all frames is than that of independent ones.
    pub(super) inflation: f64,
    /// Of whole paths the share of those of the last frame that several pixels hold.
    pub(super) copied: Option<f64>,
}

impl Correlated {
    /// Path tracing and all settings, in a view that stands still, of which the true picture is known well enough.
    pub(super) fn all(
        scene: &SceneBuffers,
        truth: &Image,
        rows: &[(&'static str, &'static str)],
    ) -> Result<Vec<Self>, Error> {
        let rows = rows.iter().copied().map(Some);
        std::iter::once(None).chain(rows).map(|settings| Self::of(scene, truth, settings)).collect()
    }

    fn of(scene: &SceneBuffers, truth: &Image, settings: Option<(&'static str, &'static str)>) -> Result<Self, Error> {
        let size = [truth.width, truth.height];
        let mut sum = Self { settings, over_pixels: 0.0, over_time: 0.0, inflation: 0.0, copied: None };
        for seed in 0..CHAINS {
            let frames = match settings {
                Some((technique, text)) => frames(scene, &Render { seed, ..study::chain(technique, size, text)? })?,
                None => samples(scene, size, seed)?,
            };
            let frames: Vec<Image> = frames.iter().map(|frame| limited(frame, truth)).collect();
            let errors = Errors::new(&frames, &limited(truth, truth))?;
            sum.over_pixels += largest(&errors) / f64::from(CHAINS);
            sum.over_time += errors.over_time(1) / f64::from(CHAINS);
            sum.inflation += errors.variance_inflation(FRAMES as usize) / f64::from(CHAINS);
        }
        if let Some((technique, text)) = settings {
            let chain = study::chain(technique, size, text)?;
            if PtSettings::of(&chain).is_some() {
                let mut cpu = CpuExecutor::inline();
                let layered = render_with_layers::<PackedPath>(&mut cpu, scene, &chain, &mut |_| Ok(()))?;
                sum.copied = Some(layered.layers.copied());
            }
        }
        Ok(sum)
    }
}

/// The frames of a chain after as many that give it a history.
fn frames(scene: &SceneBuffers, chain: &Render) -> Result<Vec<Image>, Error> {
    let chain = Render { count: 2 * FRAMES, shows: Shows::Each, ..chain.clone() };
    let (images, mut shown) = (Images::new(scene, &chain), Vec::new());
    chain.render_observed(scene, &mut CpuExecutor::inline(), &mut |step| {
        if images.is_finished(step) {
            shown.push(images.read(step)?.image);
        }
        Ok(())
    })?;
    Ok(shown.split_off(FRAMES as usize))
}

/// As many images of path tracing, which have nothing in common, of [`SAMPLES`] each: errors of about the size that frames have.
fn samples(scene: &SceneBuffers, size: [u32; 2], chain: u32) -> Result<Vec<Image>, Error> {
    let settings = PathSettings { jitter: false, sampler: Sampler::Independent, ..PathSettings::default() };
    let sample = |frame: u32| {
        let of_frame = Render { count: SAMPLES, seed: chain * FRAMES + frame, ..Render::new(size, settings.clone()) };
        Ok(of_frame.render(scene, &mut CpuExecutor::inline())?.image)
    };
    (0..FRAMES).map(sample).collect()
}

/// Values over what relMSE divides their errors by, no farther from the truth than [`LARGEST`].
pub(super) fn limited(image: &Image, truth: &Image) -> Image {
    let values = truth.pixels.as_flattened();
    let mean = values.iter().copied().map(f64::from).sum::<f64>() / values.len() as f64;
    let of_value = |x: f32, r: f32| {
        let (x, r) = (f64::from(x), f64::from(r));
        let scale = (r * r + DARK * mean * mean).sqrt();
        (r / scale + ((x - r) / scale).clamp(-LARGEST, LARGEST)) as f32
    };
    let pixels = image.pixels.iter().zip(&truth.pixels);
    let pixels = pixels.map(|(x, r)| std::array::from_fn(|i| of_value(x[i], r[i]))).collect();
    Image { pixels, ..*image }
}

/// The largest correlation between neighbours; that of a pixel with itself is none.
fn largest(errors: &Errors) -> f64 {
    let half = (0..=REACH).flat_map(|y| (-REACH..=REACH).map(move |x| [x, y]));
    let others = half.filter(|&[x, y]| y > 0 || x > 0);
    others.map(|offset| errors.over_pixels(offset)).fold(f64::NEG_INFINITY, f64::max)
}
