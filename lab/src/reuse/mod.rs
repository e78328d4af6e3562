//! `cargo lab reuse`: whether reuse of samples pays on ordinary scenes, what limits it where it does not, and the report of
//! it.

mod limits;
mod report;

use std::sync::LazyLock;
use std::time::Instant;

use clap::Args;
use restir_cli::trial::{Estimate, Judgement, Subject, Trial, Tried, Window, judge, try_once};
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::Render;
use restir_host::scene::{CameraPath, Scene};
use restir_host::technique::path::PathSettings;
use restir_host::technique::restir_di::{DiSettings, Temporal};
use restir_host::technique::{Diagnose as _, configure};

use crate::{Error, report::publish};
use limits::Limits;

/// Frames of a chain, and samples a pixel of what is without reuse.
const FRAMES: u32 = 16;
/// Paths of two segments have the direct light that all others have.
const DEPTH: u32 = 2;
/// Where settings begin with it, the last frame is judged.
const LAST_FRAME: &str = "last,";
/// What reuse is measured against, before the settings that reuse.
const BASELINES: usize = 2;

/// Options of `cargo lab reuse`.
#[derive(Args, Clone)]
pub struct Options {
    /// Scenes, in place of the five halls and the built-in scenes of more than ten emitters.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "hall-1,hall-2,hall-3,hall-4,hall-5,many-lights,moving,foliage,toys"
    )]
    scenes: Vec<String>,
    /// Settings of ReSTIR DI, as KEY=VALUE,... with the word last before them where the last frame is judged, instead of the
    /// mean of all, which only a view that stands still has; may be repeated. If not given, those of which `restir advise`
    /// names the best.
    #[arg(long = "setting", value_name = "[last,]KEY=VALUE,...")]
    settings: Vec<String>,
    /// Independent images of each.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(2..))]
    images: u32,
    /// Widths of images; their heights are three quarters of them.
    #[arg(long, value_delimiter = ',', default_value = "128,384", value_parser = clap::value_parser!(u32).range(4..=4096))]
    width: Vec<u32>,
    /// Leave out the view that stands still, or the one that orbits.
    #[arg(long, value_enum)]
    only: Option<View>,
    /// Replace docs/reuse.md, which is whole: nothing can be left out of it.
    #[arg(long, conflicts_with_all = ["scenes", "settings", "images", "width", "only"])]
    write: bool,
}

/// How the scene is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum View {
    /// From one place.
    Still,
    /// From an orbit about the camera's target, a degree a frame.
    Orbit,
}

/// Settings as `restir advise` has them.
#[derive(Clone)]
struct Setting {
    name: String,
    settings: DiSettings,
    /// Whether the mean of all frames is judged, not the last one.
    accumulate: bool,
}

impl Setting {
    fn read(name: &str) -> Result<Self, restir_host::Error> {
        let (changes, accumulate) = name.strip_prefix(LAST_FRAME).map_or((name, true), |last| (last, false));
        let mut settings = DiSettings::default();
        let changes: Vec<&str> = changes.split(',').filter(|change| !change.is_empty()).collect();
        configure(&mut settings, &changes)?;
        Ok(Self { name: name.to_owned(), settings, accumulate })
    }

    /// A view that moves has no mean.
    fn is_for(&self, view: View) -> bool {
        view == View::Still || !self.accumulate
    }

    fn render(&self, size: [u32; 2]) -> Render {
        Render { accumulate: self.accumulate, ..Render::new(size, self.settings.clone()) }
    }
}

/// One scene in one view, at one size.
struct Row {
    scene: String,
    view: View,
    width: u32,
    /// Emissive triangles and lights without a surface.
    emitters: usize,
    /// The settings for the view.
    names: Vec<String>,
    /// Of both baselines, then of the settings.
    judged: Vec<Judgement>,
    /// Of each setting; of scenes that move nothing is told.
    limits: Vec<Option<Limits>>,
}

impl Row {
    /// The better of what is without reuse.
    fn baseline(&self) -> &Judgement {
        let cost = |judged: &&Judgement| judged.rel_mse.value * judged.seconds;
        let better = self.judged[..BASELINES].iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
        better.unwrap_or(&self.judged[0])
    }

    /// relMSE over that of the baseline in the same time, of each setting.
    fn ratios(&self) -> Vec<Estimate> {
        self.judged[BASELINES..].iter().map(|judged| judged.over(self.baseline())).collect()
    }
}

/// Measures, prints the report and writes it where asked.
///
/// # Errors
/// [`Error::Host`] for unknown scenes and settings; [`Error::Io`] if the report cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
    let start = Instant::now();
    let named = if options.settings.is_empty() { proposed() } else { options.settings.clone() };
    let options = &Options { settings: named, ..options.clone() };
    let settings = options.settings.iter().map(|name| Setting::read(name)).collect::<Result<Vec<_>, _>>()?;
    let views: Vec<View> =
        [View::Still, View::Orbit].into_iter().filter(|&view| options.only.is_none_or(|only| only == view)).collect();
    let mut rows = Vec::new();
    for &width in &options.width {
        for scene in &options.scenes {
            for &view in &views {
                let of_view: Vec<_> = settings.iter().filter(|setting| setting.is_for(view)).cloned().collect();
                if of_view.is_empty() {
                    continue;
                }
                let row = measured(options.images, &of_view, scene, view, width)?;
                eprintln!("{:4.0} s  {}", start.elapsed().as_secs_f64(), report::line(&row));
                rows.push(row);
            }
        }
    }
    publish("reuse", &report::markdown(options, &rows), options.write)
}

/// What `restir advise` tries of ReSTIR DI, but for what is without reuse.
fn proposed() -> Vec<String> {
    DiSettings::default().advisable()[1..].iter().map(|&text| text.to_owned()).collect()
}

/// What all threads have had of the processors, in seconds: others may have their share of the machine. The kernel counts
/// hundredths; where it does not say, the wall's time.
fn processor_time() -> f64 {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    let ticks = || {
        let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
        // fields 14 and 15, of which the second may hold anything in parentheses
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        Some(fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?)
    };
    ticks().map_or_else(|| START.elapsed().as_secs_f64(), |ticks| 0.01 * ticks)
}

/// Independent samples, by path tracing and by resampling of 32 candidates.
fn baselines(size: [u32; 2]) -> [Render; BASELINES] {
    let path = PathSettings { max_depth: DEPTH, jitter: false, ..PathSettings::default() };
    let resampled = DiSettings {
        temporal: Temporal::Off,
        spatial: 0,
        shaded: 0,
        scatter: false,
        candidates: 32,
        ..DiSettings::default()
    };
    [Render::new(size, path), Render { accumulate: true, ..Render::new(size, resampled) }]
}

fn measured(images: u32, settings: &[Setting], name: &str, view: View, width: u32) -> Result<Row, restir_host::Error> {
    let size = [width, width * 3 / 4];
    let scene = Scene::load(name)?;
    let buffers = SceneBuffers::build(&scene)?;
    let emitters = buffers.stats().emissive_triangles as usize + scene.lights.len();
    let cameras = match view {
        View::Still => Vec::new(),
        View::Orbit => CameraPath::Orbit.cameras(buffers.camera, FRAMES)?,
    };
    let subject = Subject::new(&scene, buffers, cameras, FRAMES)?;
    let reusing = settings.iter().map(|setting| setting.render(size));
    let whole = [Window { whole: size, size, margin: 0, middle: [0.0; 2] }];
    let renders = baselines(size).into_iter().chain(reusing);
    let trials: Vec<Trial<'_>> =
        renders.map(|render| subject.trial(&Render { count: FRAMES, ..render }, &whole)).collect();
    let mut cpu = CpuExecutor::new()?;
    // the first image of each warms up
    try_once(&mut cpu, &processor_time, &trials, &mut vec![Tried::default(); trials.len()], u32::MAX, &mut |_| Ok(()))?;
    let mut tried = vec![Tried::default(); trials.len()];
    for seed in 0..images {
        try_once(&mut cpu, &processor_time, &trials, &mut tried, seed, &mut |_| Ok(()))?;
    }
    let limits = |trial: &Trial<'_>| match trial.scene.is_animated() {
        true => Ok(None),
        false => Limits::of(&mut cpu, trial.scene, &trial.pieces[0].1).map(Some),
    };
    let limits = trials[BASELINES..].iter().map(limits).collect::<Result<_, _>>()?;
    let names = settings.iter().map(|setting| setting.name.clone()).collect();
    Ok(Row { scene: name.to_owned(), view, width, emitters, names, judged: judge(&trials, &tried), limits })
}
