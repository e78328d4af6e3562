//! `restir render`

mod outputs;

use std::path::PathBuf;
use std::str::FromStr;
use std::time::{Duration, Instant};

use restir::aov::{self, Shot};
use restir::checkpoint::{Checkpoint, render_resumed};
use restir::exec::Step;
use restir::image::Channel;
use restir::render::{self, Render, Rendered};
use restir::scene::{Camera, CameraPath, Scene};
use restir::{Error, buffers::SceneBuffers, exec::Executor, memory, technique::Repeats};

use super::scene::{Additions, DEFAULT_SIZE, refuse_overwriting};
use super::technique::{PixelArguments, TechniqueArguments, configured, refuse_unused};
use super::{console, device, interrupt, metadata, progress::reported};
use outputs::Outputs;
pub(super) use outputs::ends_in;

/// How often a render that can be resumed writes down what is done.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(60);

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Name of a built-in scene (see `restir scenes`), or a .gltf or .glb file.
    scene: PathBuf,
    #[command(flatten)]
    additions: Additions,
    #[command(flatten)]
    outputs: Outputs,
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
    let done = reported("rendering", |observe| {
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
pub(super) fn cameras(path: Option<&CameraPath>, camera: Camera, frames: u32) -> Result<Vec<Camera>, Error> {
    let Some(path) = path else { return Ok(Vec::new()) };
    let bytes = u64::from(frames) * size_of::<Camera>() as u64;
    memory::check(bytes, "this camera path", "give fewer --frames")?;
    path.cameras(camera, frames)
}

/// The camera of any frame.
fn camera_of<'a>(buffers: &'a SceneBuffers, path: Option<&'a CameraPath>) -> impl Fn(f64) -> Camera + 'a {
    move |frame| path.map_or_else(|| buffers.camera_at(frame), |path| path.at(buffers.camera, frame))
}

/// What the camera sees in the frame that the render shows, as channels.
fn aovs(
    arguments: &Arguments,
    buffers: &SceneBuffers,
    render: &Render,
    camera: &dyn Fn(f64) -> Camera,
    frame: u32,
) -> Result<Vec<Channel>, Error> {
    let layers = &arguments.outputs.aov;
    if layers.is_empty() {
        return Ok(Vec::new());
    }
    let (size, integral) = ([render.width, render.height], render.technique.integral());
    let samples = if render.technique.about().repeats == Repeats::Samples { render.count } else { u32::MAX };
    let shot = Shot { scene: buffers, frame: f64::from(frame), camera, size, seed: render.seed, integral, samples };
    reported("layers", |observe| aov::channels(&shot, layers, observe))
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { additions, outputs, technique: options, .. } = arguments;
    // the checks make files for a moment
    interrupt::install()?;
    outputs.check()?;
    arguments.resume.as_deref().map_or(Ok(()), interrupt::check_writable)?;
    let mut inputs = additions.inputs(&arguments.scene);
    inputs.extend(options.camera_path.as_deref());
    refuse_overwriting(&inputs, outputs.files().chain(&arguments.resume))?;
    let mut scene = additions.open(&arguments.scene)?;
    let render = render_of(arguments, &scene)?;
    additions.complete(&mut scene, [render.width, render.height])?;
    let buffers = additions.buffers(&scene)?;
    let path = options.path()?;
    let cameras = cameras(path.as_ref(), buffers.camera, render.count)?;
    let render = Render { cameras, ..render };
    render::check(&buffers, &render)?;
    let mut device = device::open(&arguments.device)?;
    let start = Instant::now();
    let (rendered, mut channels) = render_on(device.as_mut(), &buffers, &render, arguments)?;
    let seconds = start.elapsed().as_secs_f64();
    let last = if render.technique.about().repeats == Repeats::Frames { render.count - 1 } else { 0 };
    channels.extend(aovs(arguments, &buffers, &render, &camera_of(&buffers, path.as_ref()), last)?);
    let metadata = metadata::of_render(&scene, &render, device.as_ref(), &rendered);
    interrupt::begin_writing();
    // All files come before any report: standard output may be closed or full.
    outputs.write(&rendered.image, &channels, &metadata)?;
    report(&render, &rendered, seconds)?;
    console::print(&outputs.files().map(|path| format!("wrote {}\n", path.display())).collect::<String>())
}

fn report(render: &Render, rendered: &Rendered, seconds: f64) -> Result<(), Error> {
    if rendered.dropped_samples > 0 {
        console::note(&format!(
            "warning: {} samples were dropped: not finite, or cut short by the device (a smaller --max-depth or --device cpu may help)",
            rendered.dropped_samples
        ));
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
