//! `restir render`

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::{Duration, Instant};

use restir::checkpoint::{Checkpoint, render_resumed};
use restir::exec::Step;
use restir::image::{Channel, write_exr_with, write_png};
use restir::render::{self, Render, Rendered};
use restir::scene::{Camera, CameraPath, Scene};
use restir::settings::Value;
use restir::tonemap::{Operator, Tone};
use restir::{Error, buffers::SceneBuffers, exec::Executor, memory, technique::Repeats};

use super::scene::{Additions, DEFAULT_SIZE, refuse_overwriting};
use super::technique::{PixelArguments, TechniqueArguments, configured, refuse_unused};
use super::{console, device, interrupt, metadata, progress::reported, require};

/// How often a render that can be resumed writes down what is done.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(60);
/// Stops either way: more would leave the range of floats.
const MAX_EXPOSURE: f64 = 64.0;

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Name of a built-in scene (see `restir scenes`), or a .gltf or .glb file.
    scene: PathBuf,
    #[command(flatten)]
    additions: Additions,
    /// The EXR file to write.
    #[arg(short, long)]
    output: PathBuf,
    /// Also write an 8-bit PNG file.
    #[arg(long)]
    png: Option<PathBuf>,
    /// Brighten the PNG by this many stops; each doubles it. The EXR file keeps the radiance.
    #[arg(long, value_name = "STOPS", requires = "png", allow_hyphen_values = true, default_value = "0")]
    exposure: f64,
    /// How the PNG shows what is brighter than white: clamp, reinhard, aces, or neutral (Khronos' PBR Neutral).
    #[arg(long, value_name = "OPERATOR", requires = "png", value_parser = operator, default_value = "clamp")]
    tonemap: Operator,
    #[command(flatten)]
    technique: TechniqueArguments,
    /// Samples per pixel of a technique that repeats samples; as many as suit the technique if not given.
    #[arg(long, value_parser = saturating, allow_hyphen_values = true)]
    spp: Option<u64>,
    /// Write the mean of the frames.
    #[arg(long)]
    accumulate: bool,
    /// Write what the technique holds after its last pass into further channels of the EXR file: of reservoirs .M
    /// (confidence), .W (contribution weight), .visibility, .light (index) and .age (of the sample, in frames).
    #[arg(long)]
    layers: bool,
    /// Go on from this file, if it is there. It is written every minute and when the render is interrupted, and deleted once the render
    /// is done.
    #[arg(long, value_name = "FILE", conflicts_with = "layers")]
    resume: Option<PathBuf>,
    /// Longest path in segments: 1 is directly visible light, 2 adds direct light; 8 if not given.
    #[arg(long, value_parser = natural::<u32>, allow_hyphen_values = true)]
    max_depth: Option<u32>,
    /// Image size in pixels, as WIDTHxHEIGHT; the scene's or 512x512 if not given.
    #[arg(long, allow_hyphen_values = true)]
    size: Option<Size>,
    #[command(flatten)]
    pixel: PixelArguments,
    #[command(flatten)]
    device: device::DeviceArguments,
}

/// What the arguments ask for, seen by the scene's camera.
fn render_of(arguments: &Arguments, scene: &Scene) -> Result<Render, Error> {
    let size = arguments.size.map_or(Ok(scene.default_size.unwrap_or(DEFAULT_SIZE)), Size::sides)?;
    let options = &arguments.technique;
    let technique = configured(&options.name, &options.settings, arguments.max_depth, arguments.pixel.jitter())?;
    let about = technique.about();
    let given = [
        ("--spp", arguments.spp.is_some(), Repeats::Samples),
        ("--frames", options.frames.is_some(), Repeats::Frames),
        ("--accumulate", arguments.accumulate, Repeats::Frames),
        ("--layers", arguments.layers, Repeats::Frames),
        ("--camera-path", options.camera_path.is_some(), Repeats::Frames),
    ];
    refuse_unused(technique.as_ref(), &given)?;
    let count = match arguments.spp {
        None => options.frames.unwrap_or(about.default_count),
        Some(samples) => u32::try_from(samples)
            .map_err(|_| Error::Setting(format!("{samples} samples are too many: samples > {}", u32::MAX)))?,
    };
    Ok(Render { count, accumulate: arguments.accumulate, seed: options.seed, ..Render::new(size, technique) })
}

/// Renders, with further channels for the file if layers are asked for.
fn render_on(
    executor: &mut dyn Executor,
    buffers: &SceneBuffers,
    render: &Render,
    arguments: &Arguments,
) -> Result<(Rendered, Vec<Channel>), Error> {
    let done = reported(|observe| {
        let observe = &mut |step: &Step<'_>| {
            let heard = observe(step.progress);
            if heard.is_err() && arguments.resume.is_some() {
                // what is done is written down now
                interrupt::begin_writing();
            }
            heard
        };
        if arguments.layers {
            return render.technique.render_with_layers(executor, buffers, render, observe);
        }
        let rendered = match &arguments.resume {
            Some(path) => {
                render_resumed(executor, buffers, render, Checkpoint { path, every: CHECKPOINT_EVERY }, observe)?
            }
            None => render::render(executor, buffers, render, observe)?,
        };
        Ok((rendered, Vec::new()))
    });
    if let (Err(Error::Interrupted), Some(path)) = (&done, &arguments.resume) {
        console::note(&format!("{} keeps what is done; the same command goes on", path.display()));
    }
    done
}

/// The cameras of frames along a path; none without one.
pub(super) fn cameras(path: Option<&Path>, camera: Camera, frames: u32) -> Result<Vec<Camera>, Error> {
    let Some(path) = path else { return Ok(Vec::new()) };
    let bytes = u64::from(frames) * size_of::<Camera>() as u64;
    memory::check(bytes, "this camera path", "give fewer --frames")?;
    CameraPath::open(path)?.cameras(camera, frames)
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    // the checks make files for a moment
    interrupt::install()?;
    check_outputs(arguments)?;
    let mut inputs = arguments.additions.inputs(&arguments.scene);
    inputs.extend(arguments.technique.camera_path.as_deref());
    let written = [Some(&arguments.output), arguments.png.as_ref(), arguments.resume.as_ref()];
    refuse_overwriting(&inputs, written.into_iter().flatten())?;
    let mut scene = arguments.additions.open(&arguments.scene)?;
    let render = render_of(arguments, &scene)?;
    arguments.additions.complete(&mut scene, [render.width, render.height])?;
    let buffers = arguments.additions.buffers(&scene)?;
    let cameras = cameras(arguments.technique.camera_path.as_deref(), buffers.camera, render.count)?;
    let render = Render { cameras, ..render };
    render::check(&buffers, &render)?;
    let mut device = device::open(&arguments.device)?;
    let start = Instant::now();
    let (rendered, layers) = render_on(device.as_mut(), &buffers, &render, arguments)?;
    let seconds = start.elapsed().as_secs_f64();
    let metadata = metadata::of_render(&scene, &render, device.as_ref(), &rendered);
    interrupt::begin_writing();
    // All files come before any report: standard output may be closed or full.
    write_exr_with(&arguments.output, &rendered.image, &layers, &metadata)?;
    if let Some(path) = &arguments.png {
        let tone = Tone { exposure: arguments.exposure, operator: arguments.tonemap };
        write_png(path, &tone.of(&rendered.image))?;
    }
    report(&render, &rendered, seconds)?;
    let written = [Some(&arguments.output), arguments.png.as_ref()].into_iter().flatten();
    console::print(&written.map(|path| format!("wrote {}\n", path.display())).collect::<String>())
}

/// A tone mapping by its name.
fn operator(text: &str) -> Result<Operator, String> {
    Operator::read(text).ok_or_else(|| format!("it has to be one of {}", Operator::expected()))
}

/// Before hours of rendering: can the results be written? Their endings differ, so that they are never the same file.
fn check_outputs(Arguments { output, png, exposure, resume, .. }: &Arguments) -> Result<(), Error> {
    let problem = format_args!("--exposure {exposure} is out of range; give -{MAX_EXPOSURE} to {MAX_EXPOSURE} stops");
    require(exposure.abs() <= MAX_EXPOSURE, problem)?;
    let problem = format_args!("the output {} has to end in .exr; use --png for a PNG file", output.display());
    require(ends_in(output, "exr"), problem)?;
    interrupt::check_writable(output)?;
    resume.as_deref().map_or(Ok(()), interrupt::check_writable)?;
    let Some(png) = png else { return Ok(()) };
    require(ends_in(png, "png"), format_args!("--png {} has to end in .png", png.display()))?;
    interrupt::check_writable(png)
}

pub(super) fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(ending))
}

fn report(render: &Render, rendered: &Rendered, seconds: f64) -> Result<(), Error> {
    if rendered.dropped_samples > 0 {
        console::note(&format!(
            "warning: {} samples were dropped: not finite, or cut short by the device (a smaller --max-depth or --device cpu may help)",
            rendered.dropped_samples
        ));
    }
    for (name, count) in rendered.counts.iter().filter(|(_, count)| *count > 0) {
        console::note(&format!("{}: {count}", name.replace('_', " ")));
    }
    render.technique.biases().iter().for_each(|bias| console::note(&format!("biased settings: {bias}")));
    let Render { width, height, count, .. } = render;
    let samples = f64::from(*width) * f64::from(*height) * f64::from(*count);
    console::print(&format!(
        "rendered {width} x {height} pixels with {count} {} in {seconds:.2} s ({:.3e} samples/s)\n",
        render.technique.about().repeats.name(),
        samples / seconds
    ))
}

/// A size as the user wrote it; sides that do not fit are judged later, with a better message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Size {
    width: u64,
    height: u64,
}

impl Size {
    pub(super) fn sides(self) -> Result<[u32; 2], Error> {
        let Self { width, height } = self;
        let too_large = |_| Error::Setting(format!("an image of {width} x {height} pixels is too large"));
        Ok([width.try_into().map_err(too_large)?, height.try_into().map_err(too_large)?])
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
