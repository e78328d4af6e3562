//! `restir advise`

use std::path::PathBuf;

use restir::exec::Executor;
use restir::render::{Progress, Render};
use restir::scene::Camera;
use restir::technique::{self, Repeats};
use restir::{Error, buffers::SceneBuffers};
use serde_json::json;

use super::candidate::{Candidate, LAST_FRAME, candidate, picture, refuse_twice};
use super::metadata::vector;
use super::parse::{natural, quoted, require};
use super::reference::PictureArguments;
use super::scene::DEFAULT_SIZE;
use super::technique::{cameras, path};
use super::trial::{self, Judgement, Subject, Trial, Tried, Window};
use super::{console, device, progress::reported};

/// However little time there is, each trial is rendered this often: fewer say nothing of the errors.
const FEWEST_ROUNDS: u32 = 4;
/// As many rounds are aimed at.
const ROUNDS: f64 = 6.0;
/// Size of a window and its margin, in pixels; the margin is as wide as the presets' shaded neighbours are far.
const WINDOW: [u32; 2] = [48, 36];
const MARGIN: u32 = 4;
const MOST_WINDOWS: f64 = 64.0;
/// Settings whose errors differ by fewer standard errors are not told apart.
const DISTINCT: f64 = 2.0;
const MAX_FRAMES: u32 = 4096;
/// Options that a render has not, or has otherwise, and those of them that have no value.
const OF_TRIALS: [&str; 8] =
    ["--seconds", "--technique", "--frames", "--json", "--max-depth", "--depth", "--jitter", "--no-jitter"];
const FLAGS: [&str; 3] = ["--json", "--jitter", "--no-jitter"];
const CAMERA_PATH: &str = "--camera-path";

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Name of a built-in scene, or a .gltf or .glb file.
    scene: PathBuf,
    /// How many seconds to try. Small windows of the image are rendered in that time, as many as it allows, each at
    /// least four times.
    #[arg(long, default_value = "20", value_parser = natural::<u32>, allow_hyphen_values = true)]
    seconds: u32,
    /// A technique to try, alone or with settings as in restir-di:last,preset=offline; may be repeated. If not given,
    /// each technique proposes some. The word last judges the last frame, instead of the mean of all.
    #[arg(long = "technique", value_name = "NAME[:KEY=VALUE,...]")]
    techniques: Vec<String>,
    /// Frames of ReSTIR; samples per pixel of path tracing.
    #[arg(long, default_value = "16", value_parser = natural::<u32>, allow_hyphen_values = true)]
    frames: u32,
    /// Move the camera from frame to frame: orbit, pan, or a JSON file of keyframes. The last frame counts.
    #[arg(long, value_name = "PATH")]
    camera_path: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    picture: PictureArguments,
    #[command(flatten)]
    device: device::DeviceArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let frames = arguments.frames;
    let problem = format_args!("--frames {frames} is out of range; give 1 to {MAX_FRAMES}");
    require((1..=MAX_FRAMES).contains(&frames), problem)?;
    require(arguments.seconds > 0, format_args!("0 seconds are no time to try anything; give at least 1"))?;
    let techniques = if arguments.techniques.is_empty() { proposed() } else { arguments.techniques.clone() };
    refuse_twice("technique", techniques.iter().map(String::as_str))?;
    let picture = picture(&arguments.picture, &techniques)?;
    let framed = |text: &String| {
        candidate(text, picture).map(|of| Candidate { render: Render { count: frames, ..of.render }, ..of })
    };
    let candidates = techniques.iter().map(framed).collect::<Result<Vec<_>, _>>()?;
    let unbiased = candidates.iter().any(|candidate| candidate.render.technique.biases().is_empty());
    require(unbiased, format_args!("all of the techniques are biased, so that nothing says what is right; add path"))?;
    let mut scene = arguments.picture.additions.open(&arguments.scene)?;
    let size = arguments.picture.size(scene.default_size.unwrap_or(DEFAULT_SIZE))?;
    arguments.picture.additions.complete(&mut scene, size)?;
    let buffers = arguments.picture.additions.buffers(&scene)?;
    let path = path(arguments.camera_path.as_deref(), &buffers)?;
    let cameras = cameras(path.as_ref(), buffers.camera, frames)?;
    let last_view = cameras.last().map(|camera| look(&camera.moved(buffers.origin())));
    let candidates = comparable(arguments, &buffers, candidates)?;
    let subject = Subject::new(&scene, buffers, cameras, frames)?;
    let mut device = device::open(&arguments.device)?;
    let (tried, judged) = advise(arguments, device.as_mut(), &subject, size, &candidates)?;
    let images = tried.iter().map(Tried::images).max().unwrap_or(0);
    let advice =
        Advice::new(arguments, scene.name, size, images, last_view, candidates.into_iter().zip(judged).collect());
    console::print(&if arguments.json { advice.json() } else { advice.text() })
}

/// What the techniques propose.
fn proposed() -> Vec<String> {
    let of = |technique: Box<dyn technique::Technique>| {
        let name = technique.about().name;
        let text =
            move |settings: &&str| if settings.is_empty() { name.to_owned() } else { format!("{name}:{settings}") };
        technique.advisable().iter().map(text).collect::<Vec<_>>()
    };
    technique::all().into_iter().flat_map(of).collect()
}

/// The candidates that show what the others do: what was asked for by name is refused, what was proposed is left out.
fn comparable(
    arguments: &Arguments,
    buffers: &SceneBuffers,
    candidates: Vec<Candidate>,
) -> Result<Vec<Candidate>, Error> {
    let mut kept = Vec::new();
    for candidate in candidates {
        let differs = candidate.render.technique.differs_from_path(buffers);
        let problem = differs.map(|why| format!("{} {why}", candidate.name));
        match problem {
            None => kept.push(candidate),
            Some(problem) if arguments.techniques.is_empty() => {
                console::note(&format!("warning: {problem}; it is not tried"))
            }
            Some(problem) => return Err(Error::Setting(problem)),
        }
    }
    let problem = format_args!("nothing is left to try; name techniques that show the same by --technique");
    require(!kept.is_empty(), problem)?;
    Ok(kept)
}

/// Tries everything in turns until the time is over. The first round is of one window: it tells how many are affordable.
fn advise(
    arguments: &Arguments,
    executor: &mut dyn Executor,
    subject: &Subject,
    size: [u32; 2],
    candidates: &[Candidate],
) -> Result<(Vec<Tried>, Vec<Judgement>), Error> {
    let clock = trial::wall_clock();
    let share = || clock() / f64::from(arguments.seconds);
    let shown = || Progress { done: (100.0 * share().min(0.99)) as u64, total: 100 };
    let trials_in = |count: u32| -> Vec<Trial<'_>> {
        let windows = Window::spread(size, WINDOW, MARGIN, count);
        candidates.iter().map(|candidate| subject.trial(&candidate.render, &windows)).collect()
    };
    let none = || vec![Tried::default(); candidates.len()];
    reported("rendering", |observe| {
        let probe = trials_in(1);
        check(&probe)?;
        trial::try_once(executor, &clock, &probe, &mut none(), u32::MAX, &mut |_| observe(shown()))?;
        let affordable = (1.0 - share()) / (ROUNDS * share());
        let trials = trials_in(affordable.clamp(1.0, MOST_WINDOWS) as u32);
        check(&trials)?;
        let mut tried = none();
        let mut seed = 0;
        while seed < FEWEST_ROUNDS || share() < 1.0 {
            trial::try_once(executor, &clock, &trials, &mut tried, seed, &mut |_| observe(shown()))?;
            seed += 1;
        }
        let judged = trial::judge(&trials, &tried);
        Ok((tried, judged))
    })
}

/// Whether all can be rendered.
fn check(trials: &[Trial<'_>]) -> Result<(), Error> {
    let mut pieces = trials.iter().flat_map(|trial| trial.pieces.iter().map(|(_, piece)| (trial.scene, piece)));
    pieces.try_for_each(|(scene, piece)| piece.check(scene))
}

/// A camera as --camera has it.
fn look(camera: &Camera) -> String {
    let [eye, target] = [camera.position, camera.target].map(vector);
    format!("{eye}:{target}:{}", camera.vertical_fov.to_degrees())
}

/// The options that give a technique its integral, where it has another one by itself.
fn integral(render: &Render) -> String {
    let technique = &render.technique;
    let (own, default) = (technique.integral(), technique::named(technique.about().name).map(|named| named.integral()));
    let Ok(default) = default else { return String::new() };
    let depth =
        if own.max_depth == default.max_depth { String::new() } else { format!(" --max-depth {}", own.max_depth) };
    let jitter = match own.jitter {
        same if same == default.jitter => "",
        true => " --jitter",
        false => " --no-jitter",
    };
    depth + jitter
}

/// What was found, best first.
struct Advice {
    scene: String,
    /// Those of the program, after the name of the command.
    arguments: Vec<String>,
    /// Of the last frame, where a camera path was given.
    last_view: Option<String>,
    size: [u32; 2],
    images: usize,
    frames: u32,
    rows: Vec<(Candidate, Judgement)>,
}

impl Advice {
    fn new(
        arguments: &Arguments,
        scene: String,
        size: [u32; 2],
        images: usize,
        last_view: Option<String>,
        mut rows: Vec<(Candidate, Judgement)>,
    ) -> Self {
        let cost = |judged: &Judgement| judged.rel_mse.value * judged.seconds;
        rows.sort_by(|(_, a), (_, b)| cost(a).total_cmp(&cost(b)));
        Self {
            scene,
            arguments: std::env::args_os().skip(2).map(|argument| argument.to_string_lossy().into_owned()).collect(),
            last_view,
            size,
            images,
            frames: arguments.frames,
            rows,
        }
    }

    /// How to render with the best: all that was asked for but what is of the trials.
    fn command(&self) -> String {
        let Candidate { name, render } = &self.rows[0].0;
        let (technique, settings) = name.split_once(':').unwrap_or((name, ""));
        let settings = settings.split(',').filter(|setting| !setting.is_empty() && *setting != LAST_FRAME);
        let settings: String = settings.map(|setting| format!(" --set {setting}")).collect();
        let count = self.frames;
        let repeats = match render.technique.about().repeats {
            Repeats::Samples => format!("--spp {count}"),
            Repeats::Frames if render.accumulate => format!("--frames {count} --accumulate"),
            Repeats::Frames => format!("--frames {count}"),
        };
        let view = self.last_view.as_ref().filter(|_| render.is_mean()).map(|camera| format!(" --camera {camera}"));
        format!(
            "restir render {} --technique {technique}{settings}{} {repeats}{} -o image.exr",
            self.options(render.is_mean()),
            integral(render),
            view.unwrap_or_default(),
        )
    }

    /// The scene and the options that a render has, too; without a camera path where a single view is rendered.
    fn options(&self, of_one_view: bool) -> String {
        let path = of_one_view.then_some(CAMERA_PATH);
        let own = |name: &str| OF_TRIALS.contains(&name) || path == Some(name);
        let mut given = self.arguments.iter();
        let mut kept = Vec::new();
        while let Some(argument) = given.next() {
            let (name, value) =
                argument.split_once('=').map_or((argument.as_str(), None), |(name, value)| (name, Some(value)));
            if !own(name) {
                kept.push(quoted(argument));
            } else if value.is_none() && !FLAGS.contains(&name) {
                given.next();
            }
        }
        kept.join(" ")
    }

    /// Whether the second is not worse by more than chance.
    fn is_close(&self) -> bool {
        self.rows.get(1).is_some_and(|(_, second)| {
            let over = second.over(&self.rows[0].1);
            over.value - 1.0 < DISTINCT * over.error
        })
    }

    fn text(&self) -> String {
        let [width, height] = self.size;
        let best = &self.rows[0].1;
        let row = |(technique, judged): &(Candidate, Judgement)| {
            let over = judged.over(best);
            let [value, error] = [judged.rel_mse.value, judged.rel_mse.error];
            let factor = format!("{:.2} +- {:.2}", over.value, over.error);
            let bias = if technique.render.technique.biases().is_empty() { "" } else { "  biased" };
            format!(
                "{:9.1}  {value:9.2e} +- {error:7.1e}  {factor:>16}{bias}  {}\n",
                1e3 * judged.seconds,
                technique.name
            )
        };
        let close = if self.is_close() { "The first two are not told apart; give more --seconds.\n" } else { "" };
        format!(
            "{}: {width} x {height} pixels, {} frames or samples, tried {} times\n\n\
             {:>9}  {:>20}  {:>16}  technique\n{}\n{close}{}\n",
            console::harmless(&self.scene),
            self.frames,
            self.images,
            "time, ms",
            "relMSE +- its error",
            "at equal time",
            self.rows.iter().map(row).collect::<String>(),
            self.command(),
        )
    }

    fn json(&self) -> String {
        let best = &self.rows[0].1;
        let row = |(technique, judged): &(Candidate, Judgement)| {
            let over = judged.over(best);
            json!({
                "technique": technique.name,
                "seconds": judged.seconds,
                "rel_mse": judged.rel_mse.value,
                "rel_mse_error": judged.rel_mse.error,
                "mse": judged.mse.value,
                "mse_error": judged.mse.error,
                "at_equal_time": over.value,
                "at_equal_time_error": over.error,
                "biased": !technique.render.technique.biases().is_empty(),
            })
        };
        let object = json!({
            "scene": self.scene,
            "size": self.size,
            "images": self.images,
            "frames": self.frames,
            "techniques": self.rows.iter().map(row).collect::<Vec<_>>(),
            "is_close": self.is_close(),
            "command": self.command(),
        });
        format!("{object}\n")
    }
}
