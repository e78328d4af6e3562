//! `cargo lab shifts`: what shifts of paths do in each scene, why they fail, and whether they are undone.

use std::fmt::Write as _;
use std::time::Instant;

use clap::Args;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{self, builtin};
use restir_shared::layout::{FEATURE_BLEND, FEATURE_ENVIRONMENT};
use restir_shared::shift::{Cause, Hybrid};
use restir_tests::scenes::named;
use restir_tests::stats::{FAMILY_RATE, Family};
use restir_tests::technique::restir_pt::{Arrivals, INTEGRAND, Picture, Returns, Wrong};

use crate::{Error, report};

/// Options of `cargo lab shifts`.
#[derive(Args)]
pub struct Options {
    /// Scenes; all that are built in by default, but for those with blended surfaces, of which a ray's bits decide.
    #[arg(long = "scene")]
    scenes: Vec<String>,
    /// Frames whose paths are shifted.
    #[arg(long, default_value_t = 64)]
    frames: u32,
    /// Side of the picture in pixels.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(8..=1024))]
    side: u32,
    /// Longest paths in segments.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..=63))]
    depth: u32,
    /// Replace docs/shifts.md.
    #[arg(long)]
    write: bool,
}

/// How far the pixels of a pair are apart.
const STEP: [u32; 2] = [2, 1];
/// Of shifts that give a path, the share that may not be undone, and of the light the share that goes with them.
const ONE_SIDED: f64 = 1.0e-4;
/// Of paths that come back, the share whose integrand may be off by more than [`INTEGRAND`]; in an environment it is that of a lattice.
const OFF: f64 = 0.01;
/// Segments that are joined have at least this part of the scene's shortest side (Kettunen et al. 2023).
const DISTANCE: f32 = 0.03;
const ROUGHNESS: f32 = 0.2;
const CAUSES: [Cause; 6] =
    [Cause::Unshiftable, Cause::Joins, Cause::Replay, Cause::Dark, Cause::Blocked, Cause::Broken];

/// Shifts, prints the report and writes it where asked, also if shifts are not undone: the report says where.
///
/// # Errors
/// [`Error::Failed`] if shifts are not undone or what arrives by them is not what was to be found; [`Error::Io`] if the report cannot
/// be written; whatever a scene's name or file gives.
pub fn run(options: &Options) -> Result<(), Error> {
    let start = Instant::now();
    let mut rows = Vec::new();
    let mut family = Family::new("shifts", FAMILY_RATE);
    for scene in scenes(options)? {
        rows.extend(rows_of(&scene, options, &mut family));
        eprintln!("{}: {:.1} s", scene.name, start.elapsed().as_secs_f64());
    }
    report::publish("shifts", &markdown(&rows, options), options.write)?;
    let one_sided = rows.iter().filter(|row| row.is_one_sided()).map(Row::name);
    let biased = family.verdict().err().map(|text| text.to_string());
    report::judge("not undone", one_sided.chain(biased))
}

struct Scene {
    name: String,
    buffers: SceneBuffers,
    /// The shortest side of its bounds.
    shortest: f32,
}

fn scenes(options: &Options) -> Result<Vec<Scene>, Error> {
    let asked = !options.scenes.is_empty();
    let names = builtin::NAMES.iter().map(|(name, _)| (*name).to_owned());
    let names = if asked { options.scenes.clone() } else { names.collect() };
    let load = |name: String| -> Result<Scene, Error> {
        let scene = named(&name).map_or_else(|| scene::Scene::load(&name), Ok)?;
        let [low, high] = scene.bounds();
        let shortest = (0..3).map(|axis| high[axis] - low[axis]).fold(f32::INFINITY, f32::min);
        Ok(Scene { buffers: SceneBuffers::build(&scene)?, name, shortest })
    };
    let loaded: Vec<Scene> = names.into_iter().map(load).collect::<Result<_, Error>>()?;
    Ok(loaded.into_iter().filter(|scene| asked || scene.buffers.features & FEATURE_BLEND == 0).collect())
}

/// A scene and a criterion.
struct Row {
    scene: String,
    criterion: &'static str,
    has_environment: bool,
    returns: Returns,
    /// Where camera rays go through the middles of pixels.
    at_middles: Returns,
    arrivals: Arrivals,
}

impl Row {
    fn name(&self) -> String {
        format!("{}, {}", self.scene, self.criterion)
    }

    /// Whether shifts are not undone, or undone to something else.
    fn is_one_sided(&self) -> bool {
        let beyond = |of: &Returns| of.one_sided_share() > ONE_SIDED || of.lost_share() > ONE_SIDED || of.changed > 0;
        beyond(&self.returns) || beyond(&self.at_middles) || self.is_off()
    }

    /// Whether what comes back has another integrand.
    fn is_off(&self) -> bool {
        !self.has_environment && self.returns.off_share() > OFF
    }
}

/// How many shifts are not undone, and why.
fn not_undone(returns: &Returns) -> String {
    let back = returns.back.iter().filter(|(cause, _)| **cause != Cause::Nothing);
    let causes: Vec<String> = back.map(|(cause, count)| format!("{count} {}", name(*cause))).collect();
    if causes.is_empty() { "0".to_owned() } else { causes.join(", ") }
}

fn rows_of(scene: &Scene, options: &Options, family: &mut Family) -> Vec<Row> {
    let criteria = [
        ("reconnection", Hybrid::RECONNECTION),
        ("replay", Hybrid::REPLAY),
        ("roughness, distance", Hybrid::new(ROUGHNESS, DISTANCE * scene.shortest)),
        ("footprint", Hybrid::by_footprint(0.02, 0.1)),
    ];
    let row = |(criterion, hybrid)| {
        let picture = Picture::new(&scene.buffers, options.side, options.depth, hybrid);
        let pairs = picture.pairs(STEP);
        let returns = Returns::of(&picture, &pairs, options.frames, Wrong::Not);
        let arrivals = Arrivals::of(&picture, &pairs, options.frames, Wrong::Not);
        let middles = picture.through_middles();
        let at_middles = Returns::of(&middles, &middles.pairs(STEP), options.frames, Wrong::Not);
        let has_environment = scene.buffers.features & FEATURE_ENVIRONMENT != 0;
        let row = Row { scene: scene.name.clone(), criterion, has_environment, returns, at_middles, arrivals };
        family.z_test(row.name(), row.arrivals.test());
        row
    };
    criteria.into_iter().map(row).collect()
}

fn name(cause: Cause) -> String {
    format!("{cause:?}").to_lowercase()
}

fn markdown(rows: &[Row], options: &Options) -> String {
    let Options { frames, side, depth, .. } = options;
    let mut text = format!(
        "# Shifts of paths\n\n\
         All paths to light that pixels find in {frames} frames of {side} x {side} pixels, of up to {depth} segments, shifted to the pixel \
         {} to the right and {} below, and back. Shares are of all shifts: of those that give a path, and of the causes why others do \
         not (`restir_shared::shift::Cause`). Of those that give one, how many do not come back and why, and the share of the light that is \
         concerned, which bounds what one-sided shifts change of the mean. What comes back has to be the path that path tracing found: its stored words say \
         so without exception, and *off* is the share whose integrand differs by more than {INTEGRAND:e} of itself, by what is lost in storing directions and coordinates \
         (in an environment, whose directions lie on a lattice, more do). Camera rays do not go through the middles of pixels; *at middles* has the same counts where they do. \
         Through the middles some end exactly on an edge of two walls in symmetrical scenes, from where a ray begins in the plane of the other wall. Paths \
         begin beside such an edge (`Surface::off_edges`): begun on it, up to 1.7e-3 of the shifts were one-sided in `moving` and 1.1e-3 in `cornell-mitsuba`, with \
         5.5e-4 of the light. No more than a ten-thousandth may be, of shifts and of light. At last, in standard errors, what arrives by shifts less what was to be \
         found of it: the test for Jacobians and for shifts that are not undone (`Arrivals` in `tests/src/technique/restir_pt.rs`), and the \
         bias that it notices with probability 0.99.\n\n\
         Made by `cargo lab shifts --write`. Paths are joined by reconnection alone; by nothing but sampled lights, with random \
         replay up to there; where both lobes have a roughness of {ROUGHNESS} and the segment {DISTANCE} of the scene's shortest side; \
         by a footprint of 0.02 and a spread of 0.1.\n\n\
         | scene | joined by | shifts | give a path |",
        STEP[0], STEP[1]
    );
    for cause in CAUSES {
        let _ = write!(text, " {} |", name(cause));
    }
    text +=
        " not undone | of the light | off | at middles: not undone | of the light | z | noticed |\n|---|---|---:|---:|";
    text += &"---:|".repeat(CAUSES.len() + 7);
    text.push('\n');
    for row in rows {
        let Returns { there, .. } = &row.returns;
        let all: u64 = there.values().sum();
        let share = |cause| 100.0 * there.get(&cause).copied().unwrap_or(0) as f64 / (all as f64).max(1.0);
        let _ = write!(text, "| {} | {} | {all} | {:.1} % |", row.scene, row.criterion, share(Cause::Nothing));
        for cause in CAUSES {
            let _ = write!(text, " {:.1} % |", share(cause));
        }
        let test = row.arrivals.test();
        let noticed = 100.0 * test.detectable_bias(FAMILY_RATE / rows.len() as f64) / row.arrivals.own.mean();
        let _ = writeln!(
            text,
            " {} | {:.1e} | {:.2} % | {} | {:.1e} | {:.1} | {noticed:.1} % |",
            not_undone(&row.returns),
            row.returns.lost_share(),
            100.0 * row.returns.off_share(),
            not_undone(&row.at_middles),
            row.at_middles.lost_share(),
            test.z
        );
    }
    text
}
