//! Noise of surfaces that come into view, for which reuse has no history.

use crate::correlation::{Errors, ages};
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::image::Image;
use restir_host::render::Render;
use restir_host::scene::{Camera, CameraPath};
use restir_host::technique::path::PathSettings;
use restir_kernels::reuse::reuse_reproject;
use restir_shared::resample::mutual::ShiftRequest;

use super::correlated::{SAMPLES, limited};
use super::{FRAMES, study};

/// Pixels.
pub(super) const SIZE: [u32; 2] = [128, 96];
/// The picture moves by so many pixels in a frame.
pub(super) const STEP: f64 = 8.0;
/// Independent renders.
const IMAGES: u32 = 8;
/// Samples of the true picture, and its seed, which no other has.
const TRUE_SAMPLES: u32 = 2048;
const TRUE_SEED: u32 = 1 << 31;

/// Mean squared errors of the last frame of a pan.
pub(super) struct Uncovered {
    /// The technique and its settings; nothing of path tracing.
    pub(super) settings: Option<(&'static str, &'static str)>,
    /// Where the last frame did not see the surface.
    pub(super) new: f64,
    /// Everywhere else.
    pub(super) seen: f64,
}

impl Uncovered {
    /// Path tracing and all settings, of which the first one reads the last frame, and tells which surfaces are new.
    pub(super) fn all(scene: &SceneBuffers, rows: &[(&'static str, &'static str)]) -> Result<Vec<Self>, Error> {
        let Some(&(technique, text)) = rows.first() else { return Ok(Vec::new()) };
        let path = |count, seed| Render {
            count,
            seed,
            ..Render::new(SIZE, PathSettings { jitter: false, ..PathSettings::default() })
        };
        let truth = path(TRUE_SAMPLES, TRUE_SEED).render(scene, &mut CpuExecutor::inline())?.image;
        let pan = pan(scene.camera);
        let chain =
            |technique, text| Ok::<_, Error>(Render { cameras: pan.clone(), ..study::chain(technique, SIZE, text)? });
        let ages = ages(&vec![0; truth.pixels.len()], &before(scene, &chain(technique, text)?)?);
        let rows = rows.iter().copied().map(Some);
        std::iter::once(None)
            .chain(rows)
            .map(|settings| {
                let render = match settings {
                    Some((technique, text)) => chain(technique, text)?,
                    None => path(SAMPLES, 0),
                };
                let [new, seen] = errors(scene, &render, &truth, &ages)?;
                Ok(Self { settings, new, seen })
            })
            .collect()
    }

    /// How much larger errors are where surfaces are new.
    pub(super) fn ratio(&self) -> f64 {
        self.new / self.seen
    }
}

/// A pan that ends at this camera.
fn pan(camera: Camera) -> Vec<Camera> {
    let pixel = 2.0 * (camera.vertical_fov / 2.0).tan() / f64::from(SIZE[1]);
    let degrees = (STEP * pixel).atan().to_degrees();
    (0..FRAMES).map(|frame| CameraPath::Pan.at(camera, degrees * (f64::from(frame + 1) - f64::from(FRAMES)))).collect()
}

/// Which pixel saw the surface of each pixel of the last frame in the frame before.
fn before(scene: &SceneBuffers, chain: &Render) -> Result<Vec<Option<usize>>, Error> {
    let mut requests: Vec<ShiftRequest> = Vec::new();
    chain.render_observed(scene, &mut CpuExecutor::inline(), &mut |step| {
        if step.pass.kernel.name == reuse_reproject::DESC.name {
            requests = step.plane("requests")?;
        }
        Ok(())
    })?;
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let none = || {
        Error::Setting(
            "nothing looks for surfaces in the last frame; let the first settings have temporal=on".to_owned(),
        )
    };
    let requests = requests.get(..pixels).ok_or_else(none)?;
    Ok(requests.iter().map(|request| request.exists().then_some(request.sample as usize)).collect())
}

/// Errors where surfaces are new, and where they are not: means over renders.
fn errors(scene: &SceneBuffers, render: &Render, truth: &Image, ages: &[u32]) -> Result<[f64; 2], Error> {
    let mut sums = [0.0; 2];
    for seed in 0..IMAGES {
        let image = Render { seed, ..render.clone() }.render(scene, &mut CpuExecutor::inline())?.image;
        let by_age = Errors::new(&[limited(&image, truth)], &limited(truth, truth))?.by_age(0, ages)?;
        for (age, sum) in [0, 1].iter().zip(&mut sums) {
            let none = || Error::Setting("the pan uncovers no surface, or nothing else".to_owned());
            *sum += by_age.get(age).ok_or_else(none)?.1 / f64::from(IMAGES);
        }
    }
    Ok(sums)
}
