//! `cargo lab denoised`: errors before and after the denoiser, technique by technique.

mod blur;
mod subjects;

use std::fmt::Write as _;

use clap::Args;
use restir_host::buffers::SceneBuffers;
use restir_host::denoise::Denoise;
use restir_host::exec::CpuExecutor;
use restir_host::image::Image;
use restir_host::metrics::compare;
use restir_host::render::Render;
use restir_host::scene::CameraPath;
use restir_host::technique::{Repeats, Technique};
use restir_host::tonemap::{Operator, Tone};
use restir_shared::glam::Vec3;

use crate::origin::commit;
use crate::{Error, flip, report};
use subjects::{SUBJECTS, Subject};

/// Options of `cargo lab denoised`.
#[derive(Args)]
pub struct Options {
    /// Independent images of each row.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..))]
    images: u32,
    /// Width of an image; the height is three quarters of it.
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(16..=4096))]
    width: u32,
    /// Scenes whose name contains this.
    #[arg(long, default_value = "", conflicts_with = "write")]
    only: String,
    /// Replace docs/denoised.md.
    #[arg(long)]
    write: bool,
}

/// How pictures are shown to eyes.
const SHOWN: Tone = Tone { exposure: 0.0, operator: Operator::Aces };
/// Samples of a reference.
const REFERENCE: u32 = 1024;
/// Samples or frames of a row.
const COUNTS: [u32; 2] = [1, 16];

/// Measures, prints the report and writes it where asked.
///
/// # Errors
/// [`Error::Host`] for what cannot be rendered; [`Error::Io`] if the report cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
    let mut text = head(options);
    for subject in SUBJECTS.iter().filter(|subject| subject.scene.contains(&options.only)) {
        for orbits in [false, true] {
            Measured::of(options, subject, orbits)?.rows(&mut text)?;
        }
    }
    report::publish("denoised", &text, options.write)
}

fn head(options: &Options) -> String {
    let Options { images, width, .. } = options;
    format!(
        "# Errors after the denoiser\n\nMade by `cargo lab denoised --write` at commit {}. Images of {width} x {} pixels, relMSE and FLIP of the last \
         frame against path tracing with {REFERENCE} samples, means of {images} images. In an orbit the camera moves with every frame. \"Blur\" is the \
         Gaussian blur of light over reflectance with the least relMSE, of {:?} pixels; \"over time\" is the denoiser without its filter. \"Light\" is the mean of the denoised image \
         over that of the image before.\n\n\
         | scene | technique | samples or frames | relMSE before | blur | over time | denoised | FLIP before | denoised | light |\n\
         |---|---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
        commit(),
        width * 3 / 4,
        blur::WIDTHS,
    )
}

/// A scene as it is seen, and what its last frame is to be.
struct Measured<'a> {
    subject: &'a Subject,
    orbits: bool,
    images: u32,
    /// One image of a sample or a frame.
    plain: Render,
    scene: SceneBuffers,
    cpu: CpuExecutor,
    /// For each of [`COUNTS`].
    references: Vec<Image>,
}

impl<'a> Measured<'a> {
    fn of(options: &Options, subject: &'a Subject, orbits: bool) -> Result<Self, Error> {
        let scene = SceneBuffers::build(&subject.scene()?)?;
        let (_, path) = subject.techniques()?.remove(0);
        let plain = Render::new([options.width, options.width * 3 / 4], path);
        let (images, cpu) = (options.images, CpuExecutor::new()?);
        let mut measured = Self { subject, orbits, images, plain, scene, cpu, references: Vec::new() };
        for count in COUNTS {
            let cameras = measured.cameras(count)?;
            let last = cameras.last().copied().into_iter().collect();
            let job = Render { count: REFERENCE, seed: u32::MAX, cameras: last, ..measured.plain.clone() };
            let reference = job.render(&measured.scene, &mut measured.cpu)?.image;
            measured.references.push(reference);
        }
        Ok(measured)
    }

    /// The cameras of so many frames: none for the scene's, which stands still.
    fn cameras(&self, count: u32) -> Result<Vec<restir_host::scene::Camera>, Error> {
        let orbit = CameraPath::Orbit.cameras(self.scene.camera, COUNTS[1])?;
        Ok(if self.orbits { orbit.into_iter().take(count as usize).collect() } else { Vec::new() })
    }

    fn rows(&mut self, text: &mut String) -> Result<(), Error> {
        for (name, technique) in self.subject.techniques()? {
            let is_of_samples = technique.about().repeats == Repeats::Samples;
            // samples have one camera, and a single frame no history
            let skipped = |count: u32, orbits: bool| orbits && (count == 1 || is_of_samples);
            for (at, count) in COUNTS.into_iter().enumerate() {
                if skipped(count, self.orbits) {
                    continue;
                }
                self.row(text, name, &*technique, at, count)?;
                eprintln!("{}", text.lines().last().unwrap_or_default());
            }
        }
        Ok(())
    }

    fn row(
        &mut self,
        text: &mut String,
        name: &str,
        technique: &dyn Technique,
        at: usize,
        count: u32,
    ) -> Result<(), Error> {
        let cameras = self.cameras(count)?;
        let reflectances = blur::reflectances(&self.scene, cameras.last(), [self.plain.width, self.plain.height])?;
        let over_time = Denoise { rounds: 0, ..Denoise::default() };
        let mut images = |denoise: Option<Denoise>| -> Result<Vec<Image>, Error> {
            let image = |seed| {
                let (cameras, denoise) = (cameras.clone(), denoise.clone());
                let job = Render { count, seed, cameras, denoise, technique: technique.boxed(), ..self.plain.clone() };
                Ok(job.render(&self.scene, &mut self.cpu)?.image)
            };
            (0..self.images).map(image).collect()
        };
        let [before, over_time, after] = [None, Some(over_time), Some(Denoise::default())].map(&mut images);
        let (before, over_time, after) = (before?, over_time?, after?);
        let reference = &self.references[at];
        let blurred = best_blur(&before, reference, &reflectances)?;
        let errors = [&before, &over_time, &after].map(|images| Errors::of(images, reference));
        let [before, over_time, after] = errors;
        let (before, over_time, after) = (before?, over_time?, after?);
        let scene = format!("{}{}", self.subject.scene, if self.orbits { ", an orbit" } else { "" });
        let _ = writeln!(
            text,
            "| {scene} | {name} | {count} | {:.4} | {blurred:.4} | {:.4} | {:.4} | {:.3} | {:.3} | {:.3} |",
            before.rel_mse,
            over_time.rel_mse,
            after.rel_mse,
            before.flip,
            after.flip,
            after.light / before.light
        );
        Ok(())
    }
}

/// relMSE of the blur that has the least.
fn best_blur(images: &[Image], reference: &Image, reflectances: &[Vec3]) -> Result<f64, Error> {
    let of_width = |sigma| {
        let blurred: Vec<Image> = images.iter().map(|image| blur::blurred(image, reflectances, sigma)).collect();
        Ok(Errors::of(&blurred, reference)?.rel_mse)
    };
    let errors = blur::WIDTHS.into_iter().map(of_width).collect::<Result<Vec<f64>, Error>>()?;
    Ok(errors.into_iter().fold(f64::INFINITY, f64::min))
}

/// Means over images.
#[derive(Default)]
struct Errors {
    rel_mse: f64,
    flip: f64,
    light: f64,
}

impl Errors {
    fn of(images: &[Image], reference: &Image) -> Result<Self, Error> {
        let share = 1.0 / images.len() as f64;
        let mut mean = Self::default();
        for image in images {
            let compared = compare(image, reference)?;
            mean.rel_mse += share * compared.rel_mse;
            mean.light += share * compared.mean_ratio;
            mean.flip += share * flip::mean(SHOWN, reference, image);
        }
        Ok(mean)
    }
}
