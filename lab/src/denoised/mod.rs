//! `cargo lab denoised`: error before and after the denoiser, of every technique.

mod blur;

use std::fmt::Write as _;

use clap::Args;
use restir_host::buffers::SceneBuffers;
use restir_host::denoise::Denoise;
use restir_host::exec::CpuExecutor;
use restir_host::image::Image;
use restir_host::metrics::compare;
use restir_host::render::Render;
use restir_host::scene::{Camera, Scene};
use restir_host::settings::Settings as _;
use restir_host::technique::{Repeats, named};
use restir_tests::technique::configure_by;

use crate::{Error, report};

/// Options of `cargo lab denoised`.
#[derive(Args)]
pub struct Options {
    /// Independent images of each setting.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(2..))]
    images: u32,
    /// Width of an image; the height is three quarters of it.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..=4096))]
    width: u32,
    /// Scenes whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
    /// Settings of the denoiser, `key=value` joined by commas.
    #[arg(long, default_value = "")]
    set: String,
    /// Replace docs/denoised.md.
    #[arg(long)]
    write: bool,
}

/// A scene, and the techniques that render it, with their settings.
struct Subject {
    scene: &'static str,
    reference: &'static str,
    techniques: &'static [(&'static str, &'static str)],
}

const SUBJECTS: [Subject; 4] = [
    Subject {
        scene: "cornell",
        reference: "jitter=off,max_depth=4",
        techniques: &[("path", "jitter=off,max_depth=4"), ("restir-pt", "max_depth=4")],
    },
    Subject {
        scene: "ajar",
        reference: "jitter=off,max_depth=4",
        techniques: &[("path", "jitter=off,max_depth=4"), ("restir-pt", "max_depth=4")],
    },
    Subject {
        scene: "many-lights",
        reference: "jitter=off,max_depth=2",
        techniques: &[("path", "jitter=off,max_depth=2"), ("restir-di", ""), ("restir-pt", "max_depth=2")],
    },
    Subject {
        scene: "skin-statue",
        reference: "jitter=off,max_depth=3,subsurface=diffusion",
        techniques: &[("path", "jitter=off,max_depth=3,subsurface=diffusion"), ("restir-sss", "")],
    },
];

const REFERENCE: u32 = 2048;

/// Measures, prints the report and writes it where asked.
///
/// # Errors
/// [`Error::Host`] for what cannot be rendered; [`Error::Io`] if the report cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
    let mut text = String::from(
        "| scene | technique | count | before | blur | over time | denoised | mean before | mean after |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for subject in SUBJECTS.iter().filter(|subject| subject.scene.contains(&options.only)) {
        measure(options, subject, &mut text)?;
    }
    report::publish("denoised", &text, options.write)
}

fn measure(options: &Options, subject: &Subject, text: &mut String) -> Result<(), Error> {
    let size = [options.width, options.width * 3 / 4];
    let scene = restir_tests::scenes::named(subject.scene).map_or_else(|| Scene::load(subject.scene), Ok)?;
    let buffers = SceneBuffers::build(&scene)?;
    let mut cpu = CpuExecutor::new()?;
    let reference = {
        let mut technique = named("path")?;
        configure_by(technique.as_mut(), subject.reference)?;
        let job = Render { count: REFERENCE, seed: 77, ..Render::new(size, technique) };
        job.render(&buffers, &mut cpu)?.image
    };
    let mut denoise = Denoise::default();
    for text in options.set.split(',').filter(|text| !text.is_empty()) {
        let (key, value) = text.split_once('=').unwrap_or((text, ""));
        denoise.set(key, value)?;
    }
    for (name, settings) in subject.techniques {
        for (count, orbit) in [(1, false), (16, false), (16, true)] {
            let mut technique = named(name)?;
            configure_by(technique.as_mut(), settings)?;
            let samples = technique.about().repeats == Repeats::Samples;
            if orbit && samples {
                continue;
            }
            let cameras: Vec<Camera> = if orbit {
                continue;
            } else {
                Vec::new()
            };
            let plain = Render { count, cameras, ..Render::new(size, technique) };
            let over_time = Denoise { rounds: 0, ..denoise.clone() };
            let mut images = [const { Vec::new() }; 3];
            for seed in 0..options.images {
                for (images, denoise) in images.iter_mut().zip([None, Some(over_time.clone()), Some(denoise.clone())]) {
                    let job = Render { seed, denoise, ..plain.clone() };
                    images.push(job.render(&buffers, &mut cpu)?.image);
                }
            }
            let rel = |images: &[Image]| -> Result<[f64; 2], Error> {
                let mut sum = [0.0; 2];
                for image in images {
                    let c = compare(image, &reference)?;
                    sum = [sum[0] + c.rel_mse, sum[1] + c.mean_ratio];
                }
                Ok(sum.map(|sum| sum / images.len() as f64))
            };
            let [before, over_time, after] = [rel(&images[0])?, rel(&images[1])?, rel(&images[2])?];
            let reflectance = blur::reflectances(&buffers, size);
            let mut best = f64::INFINITY;
            for sigma in blur::WIDTHS {
                let blurred: Vec<Image> =
                    images[0].iter().map(|image| blur::blurred(image, &reflectance, sigma)).collect();
                best = best.min(rel(&blurred)?[0]);
            }
            let _ = writeln!(
                text,
                "| {} | {name} | {count} | {:.4} | {best:.4} | {:.4} | {:.4} | {:.3} | {:.3} |",
                subject.scene, before[0], over_time[0], after[0], before[1], after[1]
            );
            eprintln!("{}", text.lines().last().unwrap_or_default());
        }
    }
    Ok(())
}
