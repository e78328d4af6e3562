//! `restir render`

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;

use clap::ValueEnum;
use restir::Error;
use restir::buffers::SceneBuffers;
use restir::di::{self, DiRender, DiSettings};
use restir::image::{Channel, write_exr_with, write_png};
use restir::memory;
use restir::output::check_writable;
use restir::render::{self, PathSettings, RenderSettings, Rendered};
use restir::replay::render_with_layers;
use restir::scene::{Camera, CameraPath, Scene};

use super::device::{self, Device};
use super::progress::Reporter;
use super::scene::{DEFAULT_SIZE, SceneArguments};
use super::{console, interrupt, metadata, settings};

const DEFAULT_SAMPLES: u64 = 64;
pub(super) const DEFAULT_FRAMES: u32 = 16;
/// Depth of the path tracer that computes what restir-di does.
pub(super) const DIRECT_DEPTH: u32 = 2;

#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// The EXR file to write.
    #[arg(short, long)]
    output: PathBuf,
    /// Also write an 8-bit PNG file.
    #[arg(long)]
    png: Option<PathBuf>,
    /// How to render.
    #[arg(long, value_enum, default_value_t = Technique::Path)]
    technique: Technique,
    /// Samples per pixel of the technique path; 64 if not given.
    #[arg(long, value_parser = saturating, allow_hyphen_values = true)]
    spp: Option<u64>,
    /// Frames of the technique restir-di, of which the last is written; 16 if not given.
    #[arg(long, value_parser = natural::<u32>, allow_hyphen_values = true)]
    frames: Option<u32>,
    /// Write the mean of the frames.
    #[arg(long)]
    accumulate: bool,
    /// Write what the last frame's reservoirs hold into further channels of the EXR file: reservoir.M (confidence), .W
    /// (contribution weight), .visibility, .light (index) and .age (of the sample, in frames), for the technique restir-di.
    #[arg(long)]
    layers: bool,
    /// Move the camera from frame to frame: orbit, pan, or a JSON file of keyframes.
    #[arg(long, value_name = "PATH")]
    camera_path: Option<PathBuf>,
    /// Longest path in segments: 1 is directly visible light, 2 adds direct light; 8 if not given.
    #[arg(long, value_parser = natural::<u32>, allow_hyphen_values = true)]
    max_depth: Option<u32>,
    /// Image size in pixels, as WIDTHxHEIGHT; the scene's or 512x512 if not given.
    #[arg(long, allow_hyphen_values = true)]
    size: Option<Size>,
    /// Seed of the random numbers.
    #[arg(long, default_value = "0", value_parser = natural::<u32>, allow_hyphen_values = true)]
    seed: u32,
    /// Spread the samples over the pixel instead of its centre.
    #[arg(long)]
    jitter: bool,
    #[command(flatten)]
    device: device::DeviceArguments,
    /// A setting of the technique, as KEY=VALUE, or preset=NAME; `restir settings` lists them.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Technique {
    /// Path tracing with next event estimation.
    Path,
    /// Direct light by resampling, over frames.
    RestirDi,
}

impl Technique {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::RestirDi => "restir-di",
        }
    }
}

/// What is rendered, by technique.
pub(super) enum Work {
    Path(RenderSettings),
    RestirDi(DiRender),
}

impl Work {
    fn new(arguments: &Arguments, scene: &Scene) -> Result<Self, Error> {
        settings::check_jitter(arguments.jitter, &arguments.settings)?;
        let size = match arguments.size {
            Some(size) => size.sides()?,
            None => scene.default_size.unwrap_or(DEFAULT_SIZE),
        };
        match arguments.technique {
            Technique::Path => path_settings(arguments, size).map(Self::Path),
            Technique::RestirDi => di_render(arguments, size).map(Self::RestirDi),
        }
    }

    pub(super) fn size(&self) -> [u32; 2] {
        match self {
            Self::Path(settings) => [settings.width, settings.height],
            Self::RestirDi(render) => [render.width, render.height],
        }
    }

    /// Samples or frames a pixel.
    fn samples(&self) -> u32 {
        match self {
            Self::Path(settings) => settings.samples,
            Self::RestirDi(render) => render.frames,
        }
    }

    /// With a camera that moves.
    fn along(self, path: Option<&Path>, camera: Camera) -> Result<Self, Error> {
        Ok(match self {
            Self::RestirDi(render) => {
                Self::RestirDi(DiRender { cameras: cameras(path, camera, render.frames)?, ..render })
            }
            work => work,
        })
    }

    fn check(&self, buffers: &SceneBuffers) -> Result<(), Error> {
        match self {
            Self::Path(settings) => render::check(buffers, settings),
            Self::RestirDi(render) => di::check(buffers, render),
        }
    }

    /// With further channels for the file, if `layers` are asked for.
    fn render(
        &self,
        device: &mut Device,
        buffers: &SceneBuffers,
        layers: bool,
    ) -> Result<(Rendered, Vec<Channel>), Error> {
        let mut reporter = Reporter::new();
        let mut observe = |progress| {
            reporter.update(&progress);
            if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let executor = device.executor.as_mut();
        let rendered = match self {
            Self::Path(settings) => render::render(executor, buffers, settings, &mut observe).map(without_layers),
            Self::RestirDi(render) if layers => render_with_layers(executor, buffers, render, &mut observe)
                .map(|(rendered, layers)| (rendered, layers.channels())),
            Self::RestirDi(render) => di::render(executor, buffers, render, &mut observe).map(without_layers),
        };
        reporter.finish();
        rendered
    }
}

fn without_layers(rendered: Rendered) -> (Rendered, Vec<Channel>) {
    (rendered, Vec::new())
}

/// The cameras of frames along a path; none without one.
pub(super) fn cameras(path: Option<&Path>, camera: Camera, frames: u32) -> Result<Vec<Camera>, Error> {
    let Some(path) = path else { return Ok(Vec::new()) };
    let bytes = u64::from(frames) * size_of::<Camera>() as u64;
    memory::check(bytes, "this camera path", "give fewer --frames")?;
    CameraPath::open(path)?.cameras(camera, frames)
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    check_outputs(arguments)?;
    interrupt::install()?;
    let mut scene = arguments.scene.open()?;
    let work = Work::new(arguments, &scene)?;
    arguments.scene.complete(&mut scene, work.size())?;
    let buffers = arguments.scene.buffers(&scene)?;
    let work = work.along(arguments.camera_path.as_deref(), buffers.camera)?;
    work.check(&buffers)?;
    let mut device = device::open(&arguments.device)?;
    let start = Instant::now();
    let (rendered, layers) = work.render(&mut device, &buffers, arguments.layers)?;
    let seconds = start.elapsed().as_secs_f64();
    let metadata = metadata::of_render(&scene, arguments.technique, &work, &device, &rendered);
    interrupt::begin_writing();
    // All files come before any report: standard output may be closed or full.
    write_exr_with(&arguments.output, &rendered.image, &layers, &metadata)?;
    if let Some(path) = &arguments.png {
        write_png(path, &rendered.image)?;
    }
    report(&work, &rendered, seconds)?;
    [Some(&arguments.output), arguments.png.as_ref()].into_iter().flatten().try_for_each(|path| report_written(path))
}

/// Before hours of rendering: can the results be written?
fn check_outputs(arguments: &Arguments) -> Result<(), Error> {
    if !ends_in(&arguments.output, "exr") {
        return Err(Error::Setting(format!(
            "the output {} has to end in .exr; use --png for a PNG file",
            arguments.output.display()
        )));
    }
    check_writable(&arguments.output)?;
    arguments.png.as_deref().map_or(Ok(()), check_png)
}

/// The endings differ, so that the two outputs are never the same file.
fn check_png(path: &Path) -> Result<(), Error> {
    if !ends_in(path, "png") {
        return Err(Error::Setting(format!("--png {} has to end in .png", path.display())));
    }
    check_writable(path)
}

fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(ending))
}

fn path_settings(arguments: &Arguments, [width, height]: [u32; 2]) -> Result<RenderSettings, Error> {
    if arguments.frames.is_some() || arguments.accumulate || arguments.layers || arguments.camera_path.is_some() {
        return Err(Error::Setting(
            "--frames, --accumulate, --layers and --camera-path are for techniques that reuse frames; --spp is the one of path"
                .to_owned(),
        ));
    }
    let samples = arguments.spp.unwrap_or(DEFAULT_SAMPLES);
    let samples = u32::try_from(samples)
        .map_err(|_| Error::Setting(format!("{samples} samples are too many: samples > {}", u32::MAX)))?;
    let mut path = PathSettings::default();
    path.jitter |= arguments.jitter;
    path.max_depth = arguments.max_depth.unwrap_or(path.max_depth);
    let mut render = RenderSettings { width, height, samples, seed: arguments.seed, path, dispatch_samples: None };
    arguments.settings.iter().try_for_each(|text| settings::apply(&mut render, text))?;
    Ok(render)
}

fn di_render(arguments: &Arguments, size: [u32; 2]) -> Result<DiRender, Error> {
    if arguments.spp.is_some() {
        return Err(Error::Setting("--spp is for the technique path; restir-di renders --frames".to_owned()));
    }
    check_direct(arguments.max_depth)?;
    let mut settings = DiSettings::default();
    settings::apply_di(&mut settings, &arguments.settings)?;
    settings.jitter |= arguments.jitter;
    let frames = arguments.frames.unwrap_or(DEFAULT_FRAMES);
    Ok(DiRender { frames, accumulate: arguments.accumulate, seed: arguments.seed, ..DiRender::new(size, settings) })
}

/// Refuses what `--max-depth` would ask of restir-di, if it is another depth than its own.
pub(super) fn check_direct(max_depth: Option<u32>) -> Result<(), Error> {
    if max_depth.is_some_and(|depth| depth != DIRECT_DEPTH) {
        return Err(Error::Setting(format!(
            "restir-di renders direct light, paths of {DIRECT_DEPTH} segments; leave --max-depth out"
        )));
    }
    Ok(())
}

fn report(work: &Work, rendered: &Rendered, seconds: f64) -> Result<(), Error> {
    if rendered.dropped_samples > 0 {
        console::note(&format!(
            "warning: {} samples were dropped: not finite, or cut short by the device (a smaller --max-depth or --device cpu may help)",
            rendered.dropped_samples
        ));
    }
    if let Work::RestirDi(render) = work {
        render.settings.biases().iter().for_each(|bias| console::note(&format!("biased settings: {bias}")));
    }
    let [width, height] = work.size();
    let what = if let Work::Path(_) = work { "samples" } else { "frames" };
    let samples = f64::from(width) * f64::from(height) * f64::from(work.samples());
    console::print(&format!(
        "rendered {width} x {height} pixels with {} {what} in {seconds:.2} s ({:.3e} samples/s)\n",
        work.samples(),
        samples / seconds
    ))
}

fn report_written(path: &Path) -> Result<(), Error> {
    console::print(&format!("wrote {}\n", path.display()))
}

/// A size as the user wrote it; sides that do not fit are judged later, with a better message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Size {
    width: u64,
    height: u64,
}

impl Size {
    pub(super) fn sides(self) -> Result<[u32; 2], Error> {
        let side = |side| u32::try_from(side).ok();
        side(self.width)
            .zip(side(self.height))
            .map(|(width, height)| [width, height])
            .ok_or_else(|| Error::Setting(format!("an image of {} x {} pixels is too large", self.width, self.height)))
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (width, height) = text.split_once(['x', 'X']).ok_or("it has to be WIDTHxHEIGHT, as in 640x480")?;
        Ok(Self { width: saturating(width)?, height: saturating(height)? })
    }
}

/// A natural number that fits.
pub(super) fn natural<T: FromStr>(text: &str) -> Result<T, String> {
    saturating(text)?;
    text.parse().map_err(|_| format!("it is too large; it has to be less than 2^{}", 8 * size_of::<T>()))
}

/// A natural number; what is larger than any `u64` becomes the largest.
fn saturating(text: &str) -> Result<u64, String> {
    if text.is_empty() || !text.bytes().all(|digit| digit.is_ascii_digit()) {
        return Err("it has to be a natural number".to_owned());
    }
    Ok(text.parse().unwrap_or(u64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_parsed() {
        assert_eq!("640x480".parse(), Ok(Size { width: 640, height: 480 }));
        assert_eq!("1X99999999999999999999".parse(), Ok(Size { width: 1, height: u64::MAX }));
        for text in ["", "640", "x", "1x", "-1x1", "1x1x1", "1.5x2"] {
            text.parse::<Size>().unwrap_err();
        }
    }
}
