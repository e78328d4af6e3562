//! `cargo lab figure`

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ValueEnum;
use restir::advanced::output;
use restir::advanced::reference::{Goal, Picture, Reference};
use restir::image::{MAX_SIDE, write_png};
use restir::{
    Error,
    buffers::SceneBuffers,
    exec::Executor,
    render::Progress,
    scene::Environment,
    technique::{Integral, PixelFilter},
};

use restir_cli::parse::{Size, natural, require};
use restir_cli::progress::{patiently, reported};
use restir_cli::{console, device, interrupt, reference};

use super::{
    Environs, Files, PICTURE, bitterli2020_fig1, chains::Protocol, kettunen2023_fig3, kettunen2023_fig4,
    tokuyoshi_fig1, tokuyoshi_fig2, zhang2025_candies, zhang2025_cubes, zhang2025_grid, zhang2025_places,
    zhang2025_profiles, zhang2025_walk,
};
use crate::bench::{REPORT, check_output, setup, write_text};

/// Smaller pictures decide no claim: they may be black, they fit into one tile of those that a bootstrap resamples, or
/// their pixels miss every other stripe of the wall in `bitterli2020-fig1`, whose 32 are twice as wide as a picture is high.
const MIN_SIDE: u32 = 12;
const MAX_RESTARTS: u32 = 4096;
const MAX_FRAMES: u32 = 4096;
const REFERENCE_SECONDS: u64 = 150;
/// What all figures show: direct light at the centres of pixels.
const DIRECT: Integral = Integral { max_depth: 2, jitter: false, filter: PixelFilter::Box, multiscatter: true };
/// Frames of `tokuyoshi-fig1` that do not count.
const UNCOUNTED: u32 = 16;

/// The figures that can be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Figure {
    /// Bitterli et al. 2020, supplement, figure 1: error over render time, of contribution MIS and of Talbot's, with and
    /// without reuse of visibility.
    #[value(name = "bitterli2020-fig1")]
    MisOverTime,
    /// Kettunen et al. 2023, figure 3: error by the number of borrowed suffixes, of reused and of new ones.
    #[value(name = "kettunen2023-fig3")]
    Borrowed,
    /// Kettunen et al. 2023, figure 4: error by the number of integration prefixes, with a canonical suffix for each or for some of them.
    #[value(name = "kettunen2023-fig4")]
    Prefixes,
    /// Zhang and d'Eon 2025: cubes by colour and mean free path, beside diffuse ones.
    #[value(name = "zhang2025-grid")]
    Grid,
    /// Zhang and d'Eon 2025: what each collision under a surface adds, how distances and channels are sampled, and R over the distance.
    #[value(name = "zhang2025-walk")]
    Walk,
    /// Zhang and d'Eon 2025: where profiles fail, what the hybrid makes of it, light counted twice, rays, and R beside the fits.
    #[value(name = "zhang2025-profiles")]
    Profiles,
    /// Zhang and d'Eon 2025: cubes by scale and where a profile's samples land, with the dome on and off, cubes that become slabs, and smoke.
    #[value(name = "zhang2025-cubes")]
    Cubes,
    /// Zhang and d'Eon 2025: profile, hybrid and walk where a statue is thin, hollow or thick, and by its density.
    #[value(name = "zhang2025-places")]
    Places,
    /// Zhang and d'Eon 2025: candies by what is scattered and what is transmitted, candles, and a layer that reflects.
    #[value(name = "zhang2025-candies")]
    Candies,
    /// Tokuyoshi, supplement, figure 1: the visibility term, of the selected sample and averaged.
    #[value(name = "tokuyoshi-fig1")]
    VisibilityTerm,
    /// Tokuyoshi, supplement, figure 2: what both converge to under coloured lights.
    #[value(name = "tokuyoshi-fig2")]
    ConvergedTrio,
}

/// How much a figure does, unless it is told.
struct Effort {
    size: [u32; 2],
    /// Chains of frames, and the fewest that show a spread.
    restarts: [u32; 2],
    /// Frames of a chain, and the fewest that make a picture.
    frames: [u32; 2],
    /// None if the figure makes no reference.
    reference_spp: Option<u64>,
}

impl Figure {
    fn effort(self, quick: bool) -> Effort {
        let of = |size, restarts, frames, reference_spp| Effort { size, restarts, frames, reference_spp };
        match (self, quick) {
            (Self::MisOverTime, false) => of([60, 45], [16, 4], [13, 2], Some(49_152)),
            (Self::MisOverTime, true) => of([36, 27], [8, 4], [9, 2], Some(16_384)),
            (Self::Borrowed | Self::Prefixes, false) => of([64, 48], [16, 4], [16, 2], None),
            (Self::Borrowed | Self::Prefixes, true) => of([32, 24], [8, 4], [16, 2], None),
            (Self::Grid, false) => of([64, 64], [1, 1], [128, 1], None),
            (Self::Grid, true) => of([48, 48], [1, 1], [32, 1], None),
            (Self::Walk, false) => of([96, 96], [1, 1], [256, 1], None),
            (Self::Walk, true) => of([48, 48], [1, 1], [64, 1], None),
            (Self::Profiles, false) => of([80, 80], [1, 1], [256, 1], None),
            (Self::Profiles, true) => of([40, 40], [1, 1], [64, 1], None),
            (Self::Cubes, false) => of([80, 80], [1, 1], [64, 1], None),
            (Self::Places, false) => of([80, 80], [1, 1], [32, 1], None),
            (Self::Candies, false) => of([112, 112], [1, 1], [32, 1], None),
            (Self::Cubes | Self::Places | Self::Candies, true) => of([48, 48], [1, 1], [16, 1], None),
            (Self::VisibilityTerm, false) => of([128, 96], [2, 1], [48, UNCOUNTED + 2], None),
            (Self::VisibilityTerm, true) => of([64, 48], [2, 1], [48, UNCOUNTED + 2], None),
            (Self::ConvergedTrio, false) => of([64, 48], [16, 4], [128, 1], Some(32_768)),
            (Self::ConvergedTrio, true) => of([32, 24], [8, 4], [64, 1], Some(8192)),
        }
    }
}

/// Options of `cargo lab figure`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Which figure.
    figure: Figure,
    /// Folder for the report, the data, the plots and the pictures; it is created if needed.
    #[arg(long)]
    out: PathBuf,
    /// Image size in pixels, as WIDTHxHEIGHT.
    #[arg(long, allow_hyphen_values = true)]
    size: Option<Size>,
    /// Independent repetitions, each a chain of frames; how far they differ tells the errors.
    #[arg(long, value_parser = natural::<u32>, allow_hyphen_values = true)]
    restarts: Option<u32>,
    /// Frames in each chain. Its picture is the last one, or in tokuyoshi-fig2 the mean; tokuyoshi-fig1 leaves the
    /// first 16 out. In the figures of zhang2025 it is samples per pixel, in -cubes, -places and -candies of each of
    /// eight renders.
    #[arg(long, value_parser = natural::<u32>, allow_hyphen_values = true)]
    frames: Option<u32>,
    /// Samples per pixel of the references, in figures that have one.
    #[arg(long, value_parser = natural::<u64>, allow_hyphen_values = true)]
    reference_spp: Option<u64>,
    /// The most seconds that a reference may take; 150 if not given.
    #[arg(long, value_parser = natural::<u64>, allow_hyphen_values = true)]
    reference_seconds: Option<u64>,
    /// Smaller defaults: a first look in a fourth of the time, with wider intervals.
    #[arg(long)]
    quick: bool,
    /// Environment of the exterior scene of bitterli2020-fig1 instead of its own: a latitude-longitude EXR file.
    #[arg(long, value_name = "FILE")]
    env: Option<PathBuf>,
    #[command(flatten)]
    cache: reference::Cache,
    #[command(flatten)]
    device: device::DeviceArguments,
}

/// Makes the figure, and writes its files.
///
/// # Errors
/// As of the renders that it is made of, and if an option does not suit the figure.
pub fn run(arguments: &Arguments) -> Result<(), Error> {
    let (protocol, reference) = effort(arguments)?;
    let mut warnings = Vec::new();
    let environment = arguments
        .env
        .as_deref()
        .map(|path| patiently("reading the environment", || Environment::load(path, &mut warnings)))
        .transpose()?;
    warnings.iter().for_each(|warning| console::note(&format!("warning: {warning}")));
    check_output(&arguments.out, [REPORT])?;
    let device = device::open(&arguments.device)?;
    let setup = setup(device.as_ref(), Picture { size: protocol.size, integral: DIRECT });
    let mut program = Program { device, cache: &arguments.cache, picture: setup.picture };
    let files = match arguments.figure {
        Figure::MisOverTime => {
            let frames = if arguments.quick { 8 } else { 16 };
            let effort = bitterli2020_fig1::Effort { protocol, frames, restarts: 2, reference };
            bitterli2020_fig1::make(&mut program, &effort, environment, &setup)?
        }
        Figure::Borrowed => kettunen2023_fig3::make(&mut program, protocol, &setup)?,
        Figure::Prefixes => kettunen2023_fig4::make(&mut program, protocol, &setup)?,
        Figure::Grid => zhang2025_grid::make(&mut program, protocol.size, protocol.warm_up + 1, &setup)?,
        Figure::Walk => zhang2025_walk::make(&mut program, protocol.size, protocol.warm_up + 1, &setup)?,
        Figure::Profiles => zhang2025_profiles::make(&mut program, protocol.size, protocol.warm_up + 1, &setup)?,
        Figure::Cubes => zhang2025_cubes::make(&mut program, protocol.size, protocol.warm_up + 1, &setup)?,
        Figure::Places => zhang2025_places::make(&mut program, protocol.size, protocol.warm_up + 1, &setup)?,
        Figure::Candies => zhang2025_candies::make(&mut program, protocol.size, protocol.warm_up + 1, &setup)?,
        Figure::VisibilityTerm => {
            let counted = protocol.warm_up + 1 - UNCOUNTED;
            let protocol = Protocol { warm_up: UNCOUNTED, ..protocol };
            tokuyoshi_fig1::make(&mut program, protocol, counted, &setup)?
        }
        Figure::ConvergedTrio => {
            let protocol = Protocol { accumulate: true, ..protocol };
            tokuyoshi_fig2::make(&mut program, protocol, reference, &setup)?
        }
    };
    publish(&arguments.out, &files)
}

/// The chains of the figure, and how good its references have to be.
fn effort(arguments: &Arguments) -> Result<(Protocol, Goal), Error> {
    let figure = arguments.figure;
    let Effort { size, restarts, frames, reference_spp } = figure.effort(arguments.quick);
    let size = arguments.size.map_or(Ok(size), Size::sides)?;
    let [width, height] = size;
    let problem = format_args!(
        "--size {width}x{height} is out of range, for claims need some pixels; give sides from {MIN_SIDE} to {MAX_SIDE}"
    );
    require(size.iter().all(|side| (MIN_SIDE..=MAX_SIDE).contains(side)), problem)?;
    let chains = within("--restarts", arguments.restarts, restarts, MAX_RESTARTS)?;
    let problem = format_args!("--restarts {chains} has no two equal halves; give an even number");
    require(figure != Figure::ConvergedTrio || chains.is_multiple_of(2), problem)?;
    let frames = within("--frames", arguments.frames, frames, MAX_FRAMES)?;
    let problem =
        format_args!("--env is for the exterior of bitterli2020-fig1, and this figure has none; leave it out");
    require(figure == Figure::MisOverTime || arguments.env.is_none(), problem)?;
    let asks_for_reference = arguments.reference_spp.is_some() || arguments.reference_seconds.is_some();
    let problem = format_args!(
        "--reference-spp and --reference-seconds are for figures with a reference, and this one has none; leave them out"
    );
    require(reference_spp.is_some() || !asks_for_reference, problem)?;
    let samples = arguments.reference_spp.or(reference_spp).unwrap_or(1);
    let problem = format_args!("0 samples a pixel make no reference; give at least 1 to --reference-spp");
    require(samples > 0, problem)?;
    let time = Duration::from_secs(arguments.reference_seconds.unwrap_or(REFERENCE_SECONDS));
    let protocol = Protocol { size, warm_up: frames - 1, chains, accumulate: false };
    Ok((protocol, Goal { samples, time: Some(time) }))
}

/// What was asked for, or else the default.
fn within(name: &str, asked: Option<u32>, [default, low]: [u32; 2], high: u32) -> Result<u32, Error> {
    let value = asked.unwrap_or(default);
    require((low..=high).contains(&value), format_args!("{name} {value} is out of range; give {low} to {high}"))?;
    Ok(value)
}

/// The executor, the cache of references and the console.
struct Program<'a> {
    device: Box<dyn Executor>,
    cache: &'a reference::Cache,
    picture: Picture,
}

impl Environs for Program<'_> {
    fn reference(&mut self, name: &str, scene: &SceneBuffers, goal: Goal) -> Result<Reference, Error> {
        console::note(&format!("{name}: reference"));
        reference::make(self.device.as_mut(), scene, self.picture, self.cache, goal)
    }

    fn run<T>(
        &mut self,
        what: &str,
        work: impl FnOnce(&mut dyn Executor, &mut dyn FnMut(Progress) -> Result<(), Error>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        console::note(what);
        reported("rendering", |observe| work(self.device.as_mut(), observe))
    }
}

/// Writes the files; the report, which refers to the others, comes last.
fn publish(out: &Path, Files { picture, texts, report }: &Files) -> Result<(), Error> {
    interrupt::begin_writing();
    output::make_folder(out)?;
    picture.as_ref().map_or(Ok(()), |picture| write_png(&out.join(PICTURE), picture))?;
    texts.iter().try_for_each(|(name, text)| write_text(out, name, text))?;
    write_text(out, REPORT, report)?;
    let names = picture.iter().map(|_| PICTURE).chain(texts.iter().map(|(name, _)| name.as_str())).chain([REPORT]);
    let paths: Vec<String> = names.map(|name| out.join(name).display().to_string()).collect();
    console::print(&format!("{report}\nwrote {}\n", paths.join(", ")))
}
