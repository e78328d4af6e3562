//! `restir render`

mod denoiser;
mod numbered;
mod outputs;
mod part;
mod stop;

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use restir::advanced::aov::Shot;
use restir::advanced::checkpoint::{Checkpoint, render_resumed};
use restir::advanced::output;
use restir::advanced::part::Unit;
use restir::exec::{Description, Step};
use restir::image::Channel;
use restir::render::{Images, Progress, Render, Rendered, Shows};
use restir::scene::{Camera, CameraPath, Scene};
use restir::technique::inspect::Layered;
use restir::{Error, buffers::SceneBuffers, exec::Executor, technique::Repeats};

use super::job::JobArguments;
use super::parse::{natural, require};
use super::scene::{Additions, refuse_overwriting};
use super::scrambles::{self, Mean};
use super::technique::{Frames, MAX_FRAME, cameras};
use super::{console, device, interrupt, metadata, progress::patiently, progress::reported, tev::Viewer};
use denoiser::Denoiser;
pub(super) use outputs::Outputs;
use part::{Asked, PartArguments};
use stop::Stop;

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
    job: JobArguments,
    /// Denoise the image: neighbours that see the same surface are averaged, as far as noise explains their difference. Frames before the last
    /// one help (ReSTIR). With =oidn, Open Image Denoise does it, if this program was built with it.
    #[arg(long, value_enum, value_name = "DENOISER", num_args = 0..=1, require_equals = true, default_missing_value = "svgf")]
    denoise: Option<Denoiser>,
    /// Add channels to the EXR file that show how the technique works. ReSTIR shows its reservoirs: .M (confidence), .W
    /// (contribution weight), .visibility, .light (index) and .age (of the sample, in frames). Path tracing through
    /// scattering media shows order.N, the light that was scattered N times inside, each in a render of its own.
    #[arg(long)]
    layers: bool,
    /// Save what is done in this file, every minute and on Ctrl-C, and go on from it if it is there. It is deleted once
    /// the render is done. Of --frames A..B (ReSTIR) it gets the state after frame B once that is done, from which the render of the next ones goes
    /// on.
    #[arg(long, value_name = "FILE", conflicts_with = "layers")]
    resume: Option<PathBuf>,
    /// Render a turntable: the camera goes once around its target in this many frames, each written to its own file; with --frames
    /// A..B those alone.
    #[arg(long, value_name = "FRAMES", value_parser = natural::<u32>, conflicts_with = "camera_path")]
    turntable: Option<u32>,
    /// Of several frames, skip those whose file is already there, if it is of the same render.
    #[arg(long)]
    skip_existing: bool,
    #[command(flatten)]
    part: PartArguments,
    #[command(flatten)]
    stop: Stop,
    /// Show the image in the viewer tev while it renders; tev listens at this address.
    #[arg(long, value_name = "HOST:PORT", conflicts_with = "layers")]
    tev: Option<String>,
    #[command(flatten)]
    device: device::DeviceArguments,
}

/// A scene with its cameras, and what is asked for.
struct Task<'a> {
    arguments: &'a Arguments,
    scene: &'a Scene,
    buffers: &'a SceneBuffers,
    path: Option<CameraPath>,
}

/// What was rendered, and what an image should say of it.
struct Finished {
    rendered: Rendered,
    channels: Vec<Channel>,
    render: Render,
    more: Vec<(&'static str, String)>,
}

impl Arguments {
    /// The frames that become files of their own.
    fn numbered(&self, part: Option<&Asked>) -> Result<Option<RangeInclusive<u32>>, Error> {
        if part.is_some_and(|part| part.unit == Unit::Frames) {
            return Ok(None);
        }
        let frames = match (&self.job.technique.frames, self.turntable) {
            (Some(Frames::Each(frames)), turns) => {
                let problem = format_args!("--turntable has fewer frames than --frames asks for; count them from 0");
                require(turns.is_none_or(|turns| turns == 0 || *frames.end() < turns), problem)?;
                frames.clone()
            }
            (Some(Frames::Count(_)), Some(_)) => {
                let problem =
                    "--turntable says how many frames there are; leave out --frames, or give A..B for some of them";
                return Err(Error::Setting(problem.to_owned()));
            }
            (None, Some(frames)) => 0..=frames.saturating_sub(1),
            _ => {
                let problem = format_args!("--skip-existing is for the files of several frames; give --frames A..B");
                return require(!self.skip_existing, problem).map(|()| None);
            }
        };
        let problem = format_args!("a turntable of 0 frames shows nothing; give --turntable at least 1");
        require(self.turntable != Some(0), problem)?;
        let problem = format_args!("--turntable has too many frames; give at most {}", MAX_FRAME + 1);
        require(*frames.end() <= MAX_FRAME, problem)?;
        let of_one = [
            ("--accumulate", self.job.accumulate),
            ("--layers", self.layers),
            ("--seconds", self.stop.seconds.is_some()),
            ("--noise", self.stop.noise.is_some()),
        ];
        let given = of_one.iter().find(|(_, given)| *given).map(|(option, _)| option);
        let option = given.unwrap_or(&"");
        let problem = format_args!("{option} is for a single image; leave it out, or give one frame by --time");
        require(given.is_none(), problem).map(|()| Some(frames))
    }

    /// The path of the camera, if it has one.
    fn path(&self, scene: &SceneBuffers) -> Result<Option<CameraPath>, Error> {
        self.turntable.map_or_else(|| self.job.technique.path(scene), |frames| Ok(Some(CameraPath::Turntable(frames))))
    }

    /// What is asked for, seen by the scene's camera.
    fn render(
        &self,
        scene: &Scene,
        numbered: Option<&RangeInclusive<u32>>,
        part: Option<&Asked>,
    ) -> Result<Render, Error> {
        let job = self.job.render(scene)?;
        let (about, options) = (job.technique.about(), &self.job.technique);
        let counted = matches!(options.frames, Some(Frames::Count(_)));
        let walks = options.camera_path.is_some() && numbered.is_none();
        if about.repeats == Repeats::Samples && (counted || walks) {
            let (option, name) = (if counted { "--frames COUNT" } else { "--camera-path" }, about.name);
            return Err(Error::Setting(format!(
                "{option} is not for one image of {name}, which repeats samples (--spp); --frames A..B renders one frame after another \
                 to files, -o out.####.exr"
            )));
        }
        let count = match numbered {
            _ if self.job.spp.is_some() || counted => job.count,
            Some(frames) if about.repeats == Repeats::Frames => frames.end() + 1,
            _ => part.and_then(Asked::least_samples).unwrap_or(job.count),
        };
        let viewed = self.tev.is_some() && !self.layers && !self.stop.is_asked();
        let every = viewed || (numbered.is_some() && about.repeats == Repeats::Frames);
        let shows = if every { Shows::Each } else { Shows::Last };
        let denoise = self.denoise.and_then(Denoiser::settings);
        Ok(Render { count, denoise, shows, ..job })
    }
}

impl Task<'_> {
    fn camera(&self, frame: f64) -> Camera {
        let own = || self.buffers.camera_at(frame);
        self.path.as_ref().map_or_else(own, |path| path.at(self.buffers.camera, frame))
    }

    /// What the camera sees in a frame, as channels.
    fn layers(
        &self,
        render: &Render,
        frame: u32,
        observe: &mut dyn FnMut(Progress) -> Result<(), Error>,
    ) -> Result<Vec<Channel>, Error> {
        let layers = &self.arguments.outputs.aov;
        if layers.is_empty() {
            Ok(Vec::new())
        } else {
            self.shot(render, frame, &|frame| self.camera(frame)).channels_observed(layers, observe)
        }
    }

    /// What the camera sees in a frame.
    fn shot<'a>(&'a self, render: &Render, frame: u32, camera: &'a dyn Fn(f64) -> Camera) -> Shot<'a> {
        let (size, integral) = ([render.width, render.height], render.technique.integral());
        let samples = if render.technique.about().repeats == Repeats::Samples { render.count } else { u32::MAX };
        Shot { scene: self.buffers, frame: f64::from(frame), camera, size, seed: render.seed, integral, samples }
    }

    /// A single image.
    fn one(&self, device: &mut dyn Executor, viewer: &mut Viewer, render: Render) -> Result<(), Error> {
        if device.describe().adapter.is_none() && !self.buffers.is_animated() {
            // its tree is a part of the scene, whose building is not what is timed; where things move each frame has one of its own
            patiently("building the tree", || self.buffers.tracer());
        }
        let start = Instant::now();
        let Arguments { outputs, stop, .. } = self.arguments;
        let mut finished = match stop.is_asked() {
            true => self.until(device, viewer, render)?,
            false => self.whole(device, viewer, render)?,
        };
        let render = &finished.render;
        let last = if render.technique.about().repeats == Repeats::Frames { render.count - 1 } else { 0 };
        if self.arguments.denoise == Some(Denoiser::Oidn) {
            let noisy = std::mem::take(&mut finished.rendered.image);
            finished.rendered.image = denoiser::by_oidn(noisy, &self.shot(render, last, &|frame| self.camera(frame)))?;
            finished.more.push(("denoise", "oidn".to_owned()));
        }
        let seconds = start.elapsed().as_secs_f64();
        viewer.show(&finished.rendered.image);
        if !outputs.aov.is_empty() {
            let layers = reported("layers", |observe| self.layers(render, last, observe))?;
            finished.channels.extend(layers);
        }
        interrupt::begin_writing();
        // All files come before any report: standard output may be closed or full.
        self.write(outputs, &device.describe(), &finished)?;
        report(&finished, seconds)?;
        console::print(&outputs.files().map(|path| format!("wrote {}\n", path.display())).collect::<String>())
    }

    fn write(&self, outputs: &Outputs, device: &Description, finished: &Finished) -> Result<(), Error> {
        let Finished { rendered, channels, render, more } = finished;
        let aov = (!outputs.aov.is_empty()).then(|| ("aov", outputs.layer_names()));
        let more = more.iter().cloned().chain(aov).collect();
        let metadata = metadata::of_render(self.scene, render, device, rendered, more);
        let _making = output::making();
        patiently("writing the files", || outputs.write(&rendered.image, channels, &metadata))
    }

    /// Renders, with further channels for the file if layers are asked for.
    fn whole(&self, device: &mut dyn Executor, viewer: &mut Viewer, render: Render) -> Result<Finished, Error> {
        let (buffers, arguments) = (self.buffers, self.arguments);
        let images = viewer.is_open().then(|| Images::new(buffers, &render));
        let done = reported("rendering", |observe| {
            let observe = &mut |step: &Step<'_>| {
                if let Some(images) = images.as_ref().filter(|images| viewer.is_due() && images.is_finished(step)) {
                    viewer.show(&images.read(step)?.image);
                }
                observe(step.progress)
            };
            if arguments.layers {
                return render.technique.inspect().render_with_layers(device, buffers, &render, observe);
            }
            let rendered = match &arguments.resume {
                Some(path) => {
                    let checkpoint = Checkpoint { path, every: CHECKPOINT_EVERY };
                    render_resumed(device, buffers, &render, checkpoint, observe)?
                }
                None => render.render_observed(buffers, device, observe)?,
            };
            Ok(Layered { rendered, layers: Vec::new() })
        });
        if let (Err(Error::Interrupted), Some(path)) = (&done, &arguments.resume) {
            console::note(&format!("{} keeps what is done: the same command goes on from there", path.display()));
        }
        let Layered { rendered, layers: channels } = done?;
        Ok(Finished { rendered, channels, render, more: Vec::new() })
    }

    /// Renders until it is time to stop.
    fn until(&self, device: &mut dyn Executor, viewer: &mut Viewer, render: Render) -> Result<Finished, Error> {
        let (buffers, stop) = (self.buffers, &self.arguments.stop);
        let until = stop.until();
        let (mean, render) = reported("rendering", |observe| {
            let mut render = render;
            let chosen = self.arguments.job.spp.is_none() && render.technique.about().repeats == Repeats::Samples;
            if let Some(time) = until.time.filter(|_| chosen) {
                render.count = scrambles::affordable(device, buffers, &render, time, &mut |_| interrupt::check())?;
            }
            let mut shown = |mean: &Mean| {
                if viewer.is_due() {
                    viewer.show(&mean.rendered().image);
                }
                Ok(())
            };
            let mean = scrambles::render_until(device, buffers, &render, until, observe, &mut shown)?;
            Ok::<_, Error>((mean, render))
        })?;
        let more = vec![("scrambles", mean.count().to_string()), ("noise", format!("{:.6}", mean.noise()))];
        Ok(Finished { rendered: mean.rendered(), channels: Vec::new(), render, more })
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { additions, outputs, job, .. } = arguments;
    arguments.stop.check()?;
    let part = arguments.part()?;
    let numbered = arguments.numbered(part.as_ref())?;
    let mut written = match (&part, &numbered) {
        (Some(_), frames) => outputs.of_parts(frames.as_ref())?,
        (None, None) => outputs.of_one()?,
        (None, Some(frames)) => outputs.of_each(frames)?,
    };
    if let Some(resume) = &arguments.resume {
        output::check_writable(resume)?;
        written.push(resume.clone());
    }
    let inputs = additions.inputs(&arguments.scene).into_iter().chain(job.technique.camera_path.as_deref());
    refuse_overwriting(inputs, &written)?;
    let mut scene = additions.open(&arguments.scene)?;
    refuse_overwriting(&scene.files, &written)?;
    arguments.denoise.map_or(Ok(()), |denoiser| denoiser.check(numbered.is_some()))?;
    let render = arguments.render(&scene, numbered.as_ref(), part.as_ref())?;
    let size = [render.width, render.height];
    additions.complete(&mut scene, size)?;
    let buffers = additions.buffers(&scene)?;
    let path = arguments.path(&buffers)?;
    let frames = numbered.as_ref().map_or(render.count, |frames| frames.end() + 1);
    let cameras = cameras(path.as_ref(), buffers.camera, frames)?;
    let render = Render { cameras, ..render };
    render.check(&buffers)?;
    let is_of_samples = render.technique.about().repeats == Repeats::Samples;
    let problem = format_args!(
        "--resume is for one image of path tracing, whose frames do without each other; give --skip-existing instead"
    );
    require(numbered.is_none() || arguments.resume.is_none() || !is_of_samples, problem)?;
    remark(&render, &buffers, numbered.is_none() && path.is_none());
    let task = Task { arguments, scene: &scene, buffers: &buffers, path };
    let mut viewer = Viewer::open(arguments.tev.as_deref(), outputs.output.display().to_string(), size)?;
    let mut device = device::open_for(&arguments.device, &buffers, &render)?;
    if let Some(part) = part {
        return task.part(device.as_mut(), &render, &part, numbered);
    }
    match numbered {
        None => task.one(device.as_mut(), &mut viewer, render),
        Some(frames) => task.numbered(device.as_mut(), &mut viewer, &render, frames),
    }
}

/// Says what of the settings gives another image than somebody may expect who does not know the technique; `one` is a single image
/// without a camera path.
fn remark(render: &Render, scene: &SceneBuffers, one: bool) {
    let technique = render.technique.as_ref();
    let name = technique.about().name;
    let still = one && !scene.is_animated();
    let alone = technique.about().repeats == Repeats::Frames && !technique.looks_back() && !render.accumulate;
    let wasted = (still && alone && render.count > 1).then(|| {
        let count = render.count;
        format!("makes {count} frames, each without the others, and shows the last; give --accumulate for their mean")
    });
    let remarks = [technique.leaves_out(scene).map(str::to_owned), technique.without_effect(scene), wasted];
    for remark in remarks.iter().flatten() {
        console::note(&format!("warning: {name} {remark}"));
    }
}

fn report(finished: &Finished, seconds: f64) -> Result<(), Error> {
    let Finished { rendered, render, more, .. } = finished;
    warn(render, rendered);
    let Render { width, height, count, .. } = render;
    let repeats = render.technique.about().repeats.name();
    let samples = f64::from(*width) * f64::from(*height) * f64::from(*count);
    let done = format!("rendered {width} x {height} pixels with {count} {repeats}");
    match more.as_slice() {
        [(_, scrambles), (_, noise)] => console::print(&format!(
            "{done} in each of {scrambles} scrambles in {seconds:.2} s, with a standard error of {noise} of the mean\n"
        )),
        _ => console::print(&format!("{done} in {seconds:.2} s ({:.3e} samples/s)\n", samples / seconds)),
    }
}

/// Says what may be wrong with the image.
fn warn(render: &Render, rendered: &Rendered) {
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
}
