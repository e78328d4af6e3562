//! Open Image Denoise (feature `oidn`), beside [`crate::denoise`]: a network that was trained on other renders. It sees one image and its albedo
//! and normals, knows nothing of frames before, and gives other bits on other processors.
//!
//! The library is linked where the environment variable `OIDN_DIR` says when this is built, else as `pkg-config` finds it.
//!
//! ```
//! use restir_host::aov::Shot;
//! use restir_host::render::Render;
//! use restir_host::technique::path::PathSettings;
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, oidn, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 4, ..Render::new([32, 24], PathSettings::default()) };
//! let noisy = job.render(&scene, &mut CpuExecutor::new()?)?.image;
//!
//! let (camera, integral) = (|_| scene.camera, job.technique.integral());
//! let shot = Shot { scene: &scene, frame: 0.0, camera: &camera, size: [32, 24], seed: job.seed, integral, samples: 4 };
//! let denoised = oidn::denoise(&noisy, &shot)?;
//! assert_eq!(denoised.pixels.len(), noisy.pixels.len());
//! # Ok::<(), Error>(())
//! ```

use crate::Error;
use crate::aov::{Aov, Shot};
use crate::image::{Channel, Image};
use ::oidn::{Device, RayTracing};

/// The image of a shot, denoised on the processor.
///
/// # Errors
/// [`Error::Setting`] for what the library reports; what [`Shot::channels`] returns; [`Error::SizeMismatch`] if the image has not the shot's size.
pub fn denoise(image: &Image, shot: &Shot<'_>) -> Result<Image, Error> {
    let Image { width, height, .. } = *image;
    if shot.size != [width, height] {
        return Err(Error::SizeMismatch { test: [width, height], reference: shot.size });
    }
    let [albedo, normal] = [Aov::Albedo, Aov::Normal].map(|layer| shot.channels(&[layer]));
    let (albedo, normal) = (interleaved(&albedo?), interleaved(&normal?));
    let mut pixels = image.pixels.clone();
    filter([width, height], &albedo, &normal, pixels.as_flattened_mut())
        .map_err(|error| Error::Setting(format!("Open Image Denoise does not work here: {error}")))?;
    Ok(Image { width, height, pixels })
}

fn filter([width, height]: [u32; 2], albedo: &[f32], normal: &[f32], color: &mut [f32]) -> Result<(), ::oidn::Error> {
    let device = Device::cpu()?;
    let mut filter = RayTracing::try_new(&device)?;
    filter.image_dimensions(width as usize, height as usize).hdr(true).albedo_normal(albedo, normal).clean_aux(true);
    filter.filter_in_place(color)
}

/// Three channels as pixels.
fn interleaved(channels: &[Channel]) -> Vec<f32> {
    let pixel = |i: usize| channels.iter().map(move |channel| channel.values[i]);
    (0..channels.first().map_or(0, |channel| channel.values.len())).flat_map(pixel).collect()
}
