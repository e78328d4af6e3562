//! `restir figure`

use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ValueEnum;

use super::bench::{command_line, create_folder, device_name};
use super::device::Device;
use super::progress::Reporter;
use super::reference::Cache;
use super::render::{DIRECT_DEPTH, Size, natural};
use super::{console, device, interrupt, reference};
use crate::Error;
use crate::bench::machine;
use crate::bench::table::Setup;
use crate::buffers::SceneBuffers;
use crate::exec::Executor;
use crate::figure::seed004_fig1::{self, Effort, Environs};
use crate::figure::{Contents, File};
use crate::image::write_png;
use crate::output::{check_writable, write_atomically};
use crate::reference::{Goal, Reference};
use crate::render::{MAX_SIDE, PathSettings, Progress, RenderSettings};
use crate::scene::Environment;

const REPORT: &str = "report.md";
const MAX_RESTARTS: u32 = 4096;
const MAX_FRAMES: u32 = 4096;

/// The figures that can be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Figure {
    /// Bitterli et al. 2020, supplement, figure 1: error over render time, of contribution MIS and of Talbot's, with and
    /// without reuse of visibility.
    #[value(name = "seed004-fig1")]
    Seed004Fig1,
}

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Which figure.
    figure: Figure,
    /// Folder for the report, the data, the plots and the pictures; it is created if needed.
    #[arg(long)]
    out: PathBuf,
    /// Image size in pixels, as WIDTHxHEIGHT.
    #[arg(long, allow_hyphen_values = true)]
    size: Option<Size>,
    /// Independent chains of frames.
    #[arg(long, value_parser = natural::<u32>, allow_hyphen_values = true)]
    restarts: Option<u32>,
    /// Frames of a chain; the last one is the picture.
    #[arg(long, value_parser = natural::<u32>, allow_hyphen_values = true)]
    frames: Option<u32>,
    /// Samples per pixel of the references.
    #[arg(long, value_parser = natural::<u64>, allow_hyphen_values = true)]
    reference_spp: Option<u64>,
    /// Seconds that a reference may take.
    #[arg(long, default_value = "150", value_parser = natural::<u64>, allow_hyphen_values = true)]
    reference_seconds: u64,
    /// Smaller defaults: a look in a fourth of the time, with wider intervals.
    #[arg(long)]
    quick: bool,
    /// Environment of the exterior scene instead of its own: a latitude-longitude EXR file.
    #[arg(long, value_name = "FILE")]
    env: Option<PathBuf>,
    #[command(flatten)]
    cache: Cache,
    #[command(flatten)]
    device: device::DeviceArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let effort = effort(arguments)?;
    let mut warnings = Vec::new();
    let environment = arguments.env.as_deref().map(|path| Environment::load(path, &mut warnings)).transpose()?;
    warnings.iter().for_each(|warning| console::note(&format!("warning: {warning}")));
    interrupt::install()?;
    create_folder(&arguments.out)?;
    check_writable(&arguments.out.join(REPORT))?;
    let device = device::open(&arguments.device)?;
    let setup = Setup {
        machine: machine::describe(),
        device: device_name(&device),
        commit: env!("RESTIR_COMMIT").to_owned(),
        integral: integral(effort.size),
    };
    let mut program = Program { device, cache: arguments.cache.folder(), integral: setup.integral.clone() };
    let files = match arguments.figure {
        Figure::Seed004Fig1 => seed004_fig1::make(&mut program, &effort, environment, &setup, &command_line())?,
    };
    publish(&arguments.out, &files)
}

fn effort(arguments: &Arguments) -> Result<Effort, Error> {
    let quick = arguments.quick;
    let pick = |given: Option<u32>, usual, fast| given.unwrap_or(if quick { fast } else { usual });
    let size = arguments.size.map_or(Ok(if quick { [36, 27] } else { [72, 54] }), Size::sides)?;
    if size.iter().any(|side| !(1..=MAX_SIDE).contains(side)) {
        let [width, height] = size;
        return Err(Error::Setting(format!(
            "images of {width}x{height} pixels are none; give --size with sides from 1 to {MAX_SIDE}"
        )));
    }
    let chains = within("--restarts", pick(arguments.restarts, 16, 8), [4, MAX_RESTARTS])?;
    let frames = within("--frames", pick(arguments.frames, 13, 9), [2, MAX_FRAMES])?;
    let samples = arguments.reference_spp.unwrap_or(if quick { 16_384 } else { 49_152 });
    if samples == 0 {
        return Err(Error::Setting(
            "0 samples a pixel make no reference; give at least 1 to --reference-spp".to_owned(),
        ));
    }
    let reference = Goal { samples, time: Some(Duration::from_secs(arguments.reference_seconds)) };
    let running = if quick { 8 } else { 16 };
    Ok(Effort { size, chains, warm_up: frames - 1, frames: running.min(chains), restarts: 2, reference })
}

fn within(name: &str, value: u32, [low, high]: [u32; 2]) -> Result<u32, Error> {
    (low..=high)
        .contains(&value)
        .then_some(value)
        .ok_or_else(|| Error::Setting(format!("{name} {value} is out of range; give {low} to {high}")))
}

/// Direct light of the given size.
fn integral([width, height]: [u32; 2]) -> RenderSettings {
    let path = PathSettings { max_depth: DIRECT_DEPTH, jitter: false, roulette: false };
    RenderSettings { width, height, samples: 1, seed: 0, path, dispatch_samples: None }
}

/// The executor, the cache of references and the console.
struct Program {
    device: Device,
    cache: Option<PathBuf>,
    integral: RenderSettings,
}

impl Environs for Program {
    fn reference(&mut self, name: &str, scene: &SceneBuffers, goal: Goal) -> Result<Reference, Error> {
        console::note(&format!("{name}: reference"));
        reference::make(self.device.executor.as_mut(), scene, &self.integral, self.cache.as_deref(), goal)
    }

    fn run<T>(
        &mut self,
        what: &str,
        work: impl FnOnce(&mut dyn Executor, &mut dyn FnMut(Progress) -> ControlFlow<()>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        console::note(what);
        let mut reporter = Reporter::new();
        let made = work(self.device.executor.as_mut(), &mut |progress| {
            reporter.update(&progress);
            if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        reporter.finish();
        made
    }
}

/// Writes the files; the report, which refers to the others, comes last.
fn publish(out: &Path, files: &[File]) -> Result<(), Error> {
    interrupt::begin_writing();
    for file in files {
        let path = out.join(&file.name);
        match &file.contents {
            Contents::Text(text) => write_atomically(&path, |file| file.write_all(text.as_bytes()))?,
            Contents::Picture(image) => write_png(&path, image)?,
        }
    }
    let report = files.iter().rev().find_map(|file| match &file.contents {
        Contents::Text(text) if file.name == REPORT => Some(text.as_str()),
        _ => None,
    });
    let names: Vec<String> = files.iter().map(|file| out.join(&file.name).display().to_string()).collect();
    console::print(&format!("{}\nwrote {}\n", report.unwrap_or_default(), names.join(", ")))
}
