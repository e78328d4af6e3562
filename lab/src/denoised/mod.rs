//! `cargo lab denoised`: errors before and after denoisers, technique by technique.

mod blur;
mod errors;
mod frames;
mod subjects;

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Instant;

use clap::Args;
use restir_host::aov::Shot;
use restir_host::buffers::SceneBuffers;
use restir_host::denoise::Denoise;
use restir_host::exec::CpuExecutor;
use restir_host::image::Image;
use restir_host::render::Render;
use restir_host::scene::{Camera, CameraPath};
use restir_host::technique::{Repeats, Technique};
use restir_tests::technique::configured;

use crate::origin::commit;
use crate::{Error, report};
use errors::Errors;
use frames::Last;
use subjects::{SUBJECTS, Subject, VARIANTS};

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

/// Samples of a reference.
const REFERENCE: u32 = 1024;
/// Samples or frames of a row.
const COUNTS: [u32; 2] = [1, 16];

/// Of a table.
const COLUMNS: &str = "| scene | technique | samples or frames | relMSE before | blur | over time | denoised | OIDN | FLIP before | denoised | OIDN | \
                       unsteady before | denoised | OIDN | light |\n\
                       |---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";

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
    text += "\n## What in reuse hurts\n\nThe same in an orbit, with settings changed.\n\n";
    text += COLUMNS;
    for (scene, name, settings) in VARIANTS {
        for subject in SUBJECTS.iter().filter(|subject| subject.scene == scene && scene.contains(&options.only)) {
            Measured::of(options, subject, true)?.variants(&mut text, name, settings)?;
        }
    }
    report::publish("denoised", &text, options.write)
}

fn head(options: &Options) -> String {
    let Options { images, width, .. } = options;
    format!(
        "# Errors after the denoiser\n\nMade by `cargo lab denoised --write` (8 min) at commit {}, built with Open Image Denoise: `OIDN_DIR=FOLDER cargo run --release -p \
         restir-lab --features oidn -- denoised --write`. Without it, its columns are empty.\n\nImages of {width} x {} pixels, relMSE and FLIP of the last \
         frame against path tracing with {REFERENCE} samples, means of {images} images. In an orbit the camera moves with every frame. \"Blur\" is the \
         Gaussian blur of light over reflectance with the least relMSE, of {:?} pixels; \"over time\" is the denoiser without its filter; \"OIDN\" is Open Image Denoise \
         2.5 on the last frame, with albedo and normals. \"Unsteady\" is the relMSE of the difference of the last two frames. \"Light\" is the mean of the denoised image \
         over that of the image before. \"As long\" is path tracing with as many samples as take the time of the row before, measured here on a processor.\n\n\
         {COLUMNS}",
        commit(),
        width * 3 / 4,
        blur::WIDTHS,
    )
}

/// A scene as it is seen, and what its last frames are to be.
struct Measured<'a> {
    subject: &'a Subject,
    orbits: bool,
    images: u32,
    /// One image of a sample or a frame.
    plain: Render,
    scene: Arc<SceneBuffers>,
    cpu: CpuExecutor,
    /// For each of [`COUNTS`].
    references: Vec<Last>,
}

/// What a row is of.
struct Row<'a> {
    name: &'a str,
    technique: &'a dyn Technique,
    /// Which of [`COUNTS`] its reference has.
    at: usize,
    count: u32,
    /// Samples of each frame, of path tracing in an orbit.
    samples: u32,
}

impl Row<'_> {
    fn counts(&self) -> String {
        if self.samples > 1 { format!("{} x {}", self.count, self.samples) } else { self.count.to_string() }
    }
}

impl<'a> Measured<'a> {
    fn of(options: &Options, subject: &'a Subject, orbits: bool) -> Result<Self, Error> {
        let scene = Arc::new(SceneBuffers::build(&subject.scene()?)?);
        let (_, path) = subject.techniques()?.remove(0);
        let plain = Render::new([options.width, options.width * 3 / 4], path);
        let (images, cpu) = (options.images, CpuExecutor::new()?);
        let mut measured = Self { subject, orbits, images, plain, scene, cpu, references: Vec::new() };
        for count in COUNTS {
            let mut cameras = measured.cameras(count)?;
            let last = measured.reference(cameras.pop())?;
            let before = cameras.pop().map(|camera| measured.reference(Some(camera))).transpose()?;
            measured.references.push(Last { image: last, before });
        }
        Ok(measured)
    }

    fn reference(&mut self, camera: Option<Camera>) -> Result<Image, Error> {
        let cameras = camera.into_iter().collect();
        let job = Render { count: REFERENCE, seed: u32::MAX, cameras, ..self.plain.clone() };
        Ok(job.render(&self.scene, &mut self.cpu)?.image)
    }

    /// The cameras of so many frames: none for the scene's, which stands still.
    fn cameras(&self, count: u32) -> Result<Vec<Camera>, Error> {
        let orbit = CameraPath::Orbit.cameras(self.scene.camera, COUNTS[1])?;
        Ok(if self.orbits { orbit.into_iter().take(count as usize).collect() } else { Vec::new() })
    }

    fn rows(&mut self, text: &mut String) -> Result<(), Error> {
        let (_, path) = self.subject.techniques()?.remove(0);
        // seconds of a sample
        let mut sample = f64::INFINITY;
        for (name, technique) in self.subject.techniques()? {
            let is_of_samples = technique.about().repeats == Repeats::Samples;
            // a single frame has no history
            let first = usize::from(self.orbits);
            for (at, &count) in COUNTS.iter().enumerate().skip(first) {
                let seconds = self.row(text, &Row { name, technique: &*technique, at, count, samples: 1 })?;
                if is_of_samples {
                    sample = sample.min(seconds / f64::from(count));
                    continue;
                }
                let name = "path, as long";
                let as_long = |seconds: f64| (seconds / sample).round().max(1.0) as u32;
                let samples = as_long(seconds / f64::from(count));
                let (count, samples) = if self.orbits { (count, samples) } else { (as_long(seconds), 1) };
                self.row(text, &Row { name, technique: &*path, at, count, samples })?;
            }
        }
        Ok(())
    }

    /// Rows of a technique with settings, by these.
    fn variants(&mut self, text: &mut String, name: &str, settings: &[&str]) -> Result<(), Error> {
        for &settings in settings {
            let technique = configured(name, settings)?;
            let name = format!("{name} {settings}");
            let row = Row { name: name.trim(), technique: &*technique, at: 1, count: COUNTS[1], samples: 1 };
            self.row(text, &row)?;
        }
        Ok(())
    }

    /// Adds a row, and returns how long an image took in seconds, before it was denoised.
    fn row(&mut self, text: &mut String, row: &Row<'_>) -> Result<f64, Error> {
        let start = Instant::now();
        let before = self.last(row, None)?;
        let seconds = start.elapsed().as_secs_f64() / f64::from(self.images);
        let over_time = self.last(row, Some(Denoise { rounds: 0, ..Denoise::default() }))?;
        let after = self.last(row, Some(Denoise::default()))?;
        let other = before.iter().map(|last| self.by_oidn(last, row)).collect::<Result<Option<Vec<Last>>, Error>>()?;
        let size = [self.plain.width, self.plain.height];
        let reflectances = blur::reflectances(&self.scene, self.cameras(row.count)?.last(), size)?;
        let reference = &self.references[row.at];
        let errors = |images: &[Last]| Errors::of(images, reference);
        let [before_errors, over_time, after] = [errors(&before)?, errors(&over_time)?, errors(&after)?];
        let other = other.map(|images| errors(&images)).transpose()?;
        let told = |of: &dyn Fn(&Errors) -> Option<f64>, digits: usize| {
            let cell = |errors: Option<&Errors>| {
                errors.and_then(of).map_or("–".to_owned(), |error| format!("{error:.digits$}"))
            };
            [cell(Some(&before_errors)), cell(Some(&after)), cell(other.as_ref())].join(" | ")
        };
        let scene = format!("{}{}", self.subject.scene, if self.orbits { ", an orbit" } else { "" });
        let blurred = best_blur(&before, reference, &reflectances)?;
        let oidn = other.as_ref().map_or("–".to_owned(), |errors| format!("{:.4}", errors.rel_mse));
        let _ = writeln!(
            text,
            "| {scene} | {} | {} | {:.4} | {blurred:.4} | {:.4} | {:.4} | {oidn} | {} | {} | {:.3} |",
            row.name,
            row.counts(),
            before_errors.rel_mse,
            over_time.rel_mse,
            after.rel_mse,
            told(&|errors| Some(errors.flip), 3),
            told(&|errors| errors.unsteady, 4),
            after.light / before_errors.light
        );
        eprintln!("{}", text.lines().last().unwrap_or_default());
        Ok(seconds)
    }

    /// The last frames of independent images.
    fn last(&mut self, row: &Row<'_>, denoise: Option<Denoise>) -> Result<Vec<Last>, Error> {
        let cameras = self.cameras(row.count)?;
        let image = |seed| {
            let (cameras, denoise) = (cameras.clone(), denoise.clone());
            let technique = row.technique.boxed();
            Render { count: row.count, seed, cameras, denoise, technique, ..self.plain.clone() }
        };
        let renders: Vec<Render> = (0..self.images).map(image).collect();
        let is_of_samples = row.technique.about().repeats == Repeats::Samples;
        let last = |render: Render| match self.orbits && is_of_samples {
            true => Last::of_samples(&render, row.samples, &self.scene),
            false => Last::of(&render, &self.scene, &mut self.cpu),
        };
        renders.into_iter().map(last).collect()
    }

    /// What Open Image Denoise makes of frames, if this was built with it.
    fn by_oidn(&self, last: &Last, row: &Row<'_>) -> Result<Option<Last>, Error> {
        let mut cameras = self.cameras(row.count)?;
        let mut denoised = |image: &Image| {
            let camera = cameras.pop().unwrap_or(self.scene.camera);
            let size = [image.width, image.height];
            let integral = row.technique.integral();
            let shot = Shot {
                scene: &self.scene,
                frame: 0.0,
                camera: &|_| camera,
                size,
                seed: 0,
                integral,
                samples: row.count,
            };
            by_oidn(image, &shot)
        };
        let Some(image) = denoised(&last.image)? else { return Ok(None) };
        let before = last.before.as_ref().map_or(Ok(None), denoised)?;
        Ok(Some(Last { image, before }))
    }
}

#[cfg(feature = "oidn")]
fn by_oidn(image: &Image, shot: &Shot<'_>) -> Result<Option<Image>, Error> {
    Ok(Some(restir::advanced::oidn::denoise(image, shot)?))
}

#[cfg(not(feature = "oidn"))]
fn by_oidn(_: &Image, _: &Shot<'_>) -> Result<Option<Image>, Error> {
    Ok(None)
}

/// relMSE of the blur that has the least.
fn best_blur(images: &[Last], reference: &Last, reflectances: &[restir_shared::glam::Vec3]) -> Result<f64, Error> {
    let of_width = |sigma| {
        let blurred = |last: &Last| Last { image: blur::blurred(&last.image, reflectances, sigma), before: None };
        Ok(Errors::of(&images.iter().map(blurred).collect::<Vec<_>>(), reference)?.rel_mse)
    };
    let errors = blur::WIDTHS.into_iter().map(of_width).collect::<Result<Vec<f64>, Error>>()?;
    Ok(errors.into_iter().fold(f64::INFINITY, f64::min))
}
