//! `cargo lab unbiased`: z-tests of a technique against an independent estimate of the same picture, tile by tile, over
//! many independent restarts.
//!
//! A restart is a render with its own seed, of one sample a pixel, or of a few frames of which the last counts, or their mean where
//! none knows another. It is tested against path tracing with the same [`Integral`](restir_host::technique::Integral); path tracing itself against
//! the path tracer or the walk in `f64` of the harness, see `oracle`, or with another way to find light. The moments of both sides are kept in files after every round,
//! so that a test can be interrupted and continued, or given more restarts; all settings share the reference of a scene.
//! A file knows the scene and the settings it is of, not the code: after a change of that, begin anew by `--fresh`.

mod oracle;
mod report;
mod side;
mod stage;

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use restir_host::technique::Technique;
use restir_tests::stats::{TileGrid, sidak};
use restir_tests::technique::Trials;

use crate::Error;
use crate::report::{committed, judge, publish};
use report::Row;
use stage::Stage;

/// Width and height of the pictures in pixels.
const SIZE: u32 = 32;
/// Width and height of a tile in pixels.
const TILE: u32 = 8;
const GRID: TileGrid = TileGrid { width: SIZE, height: SIZE, tile: TILE };
/// How often a family of tests fails although nothing is wrong: all of a cell, or of a technique's matrix.
const FAMILY_RATE: f64 = 1.0e-3;
/// Restarts at which a row ends, whatever its goal.
const MOST_RESTARTS: u32 = 1 << 15;
/// What a known-wrong picture is too bright by.
const WRONG_RADIANCE: f32 = 1.01;

/// Options of `cargo lab unbiased`.
#[derive(Args)]
pub struct Options {
    /// All cells that the harness declares of a technique, or its default settings and presets, with a report on them.
    #[arg(long, value_name = "NAME", required_unless_present = "cell")]
    technique: Option<String>,
    /// With --technique: replace docs/NAME-bias.md.
    #[arg(long, requires = "technique")]
    write: bool,
    /// With --technique: only the cells whose SCENE/SETTINGS have this text; with --write, the other rows of the report stay.
    #[arg(long, value_name = "TEXT", requires = "technique")]
    only: Option<String>,
    /// One cell, as `NAME[:KEY=VALUE,...]/SCENE`; the settings come after those that the harness has for the scene.
    #[arg(long, conflicts_with = "technique")]
    cell: Option<String>,
    /// With --cell: radiance x 1.01, which the test has to notice.
    #[arg(long, requires = "cell")]
    wrong: bool,
    /// Restarts to begin with, rounded up to a multiple of 256; 16384 if not given, of techniques of frames 512.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    restarts: Option<u32>,
    /// Samples a pixel of the reference in all.
    #[arg(long, default_value_t = 65_536, value_parser = clap::value_parser!(u32).range(1..))]
    reference_samples: u32,
    /// Go on, with both sides, until a bias of this many percent of the image is detectable with 99 % probability. Of a technique's
    /// cells those without a known bias go on until what the harness declares for the scene.
    #[arg(long, value_name = "PERCENT")]
    goal: Option<f64>,
    /// Go no further than that, whatever the goal.
    #[arg(long, default_value_t = MOST_RESTARTS, value_parser = clap::value_parser!(u32).range(1..))]
    most_restarts: u32,
    /// Folder of the state files.
    #[arg(long, default_value = "target/unbiased")]
    state: PathBuf,
    /// Discard the states, those of the references as well.
    #[arg(long)]
    fresh: bool,
}

/// What is known of settings before they are tested.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Expected {
    Unbiased,
    /// All known biases lose light.
    Biased,
    /// [`WRONG_RADIANCE`]: it has to be seen where the test has the power for it.
    Wrong,
}

/// The biases that a row is to notice, in percent.
#[derive(Clone, Copy, Debug)]
struct Goal {
    /// Of the image.
    image: f64,
    /// Of tiles' channels, in half of them.
    tiles: f64,
}

/// Settings that are tested.
#[derive(Clone)]
struct Cell {
    /// What they are beside the scene's and the defaults, joined by commas.
    settings: String,
    expected: Expected,
    technique: Box<dyn Technique>,
    /// What path tracing itself is compared with where the oracle does not know the scene.
    instead: Option<&'static str>,
}

impl Cell {
    fn new(trials: &Trials, scene: &str, settings: &str, wrong: bool) -> Result<Self, Error> {
        let matrix = trials.known.matrix;
        let of_scene = matrix.scenes.iter().find(|(name, _)| *name == scene).map_or("", |(_, settings)| settings);
        let technique = trials.with(&[matrix.common, of_scene, settings].join(","))?;
        let expected = match technique.biases().as_slice() {
            _ if wrong => Expected::Wrong,
            [] => Expected::Unbiased,
            _ => Expected::Biased,
        };
        let instead = matrix.beyond.iter().find(|(name, _)| *name == scene).map(|(_, settings)| *settings);
        Ok(Self { settings: settings.to_owned(), expected, technique, instead })
    }

    /// For messages and files.
    fn name(&self) -> String {
        let name = self.technique.about().name;
        let wrong = if self.expected == Expected::Wrong { " x 1.01" } else { "" };
        [name, if self.settings.is_empty() { "" } else { ":" }, &self.settings, wrong].concat()
    }
}

/// Runs or continues what is asked for and prints the verdicts.
///
/// # Errors
/// [`Error::Failed`] if anything is not as known; others for a cell that does not exist, a state that is of something else,
/// or a file that cannot be read or written.
pub fn run(options: &Options) -> Result<(), Error> {
    let name = options.cell.as_deref().unwrap_or_default();
    let (of_technique, scene) = match &options.technique {
        Some(technique) => (technique.as_str(), None),
        None => name.rsplit_once('/').map(|(technique, scene)| (technique, Some(scene))).ok_or_else(|| {
            Error::Environment(format!("there is no cell {name:?}; it is NAME[:KEY=VALUE,...]/SCENE, as path/cornell"))
        })?,
    };
    let (technique, settings) = of_technique.split_once(':').unwrap_or((of_technique, ""));
    let trials = Trials::of(technique)?;
    let (scenes, cells) = match scene {
        Some(scene) => (vec![scene], vec![(settings.to_owned(), options.wrong)]),
        None => (trials.known.matrix.scenes.iter().map(|(scene, _)| *scene).collect(), cells(&trials)),
    };
    let name = format!("{technique}-bias");
    // read before hours of measurements: a technique that has no report yet has no rows to replace
    let kept = if options.only.is_some() && options.write { Some(committed(&name)?) } else { None };
    let rows = rows(options, &trials, &scenes, &cells)?;
    if let (Some(text), true) = (&options.only, rows.is_empty()) {
        return Err(Error::Environment(format!(
            "no cell of {technique} has {text:?} in SCENE/SETTINGS; give less of it"
        )));
    }
    let made = || report::report(&trials, &rows, options.most_restarts);
    let report = match (scene, &kept) {
        (Some(_), _) => rows.iter().map(Row::in_detail).collect(),
        (None, None) => made(),
        (None, Some(kept)) => report::replaced(kept, &made())?,
    };
    publish(&name, &report, options.write)?;
    judge("not as known", report::findings(&rows, options.only.is_none()))
}

/// Tests all cells on all scenes, as one family.
fn rows(options: &Options, trials: &Trials, scenes: &[&str], cells: &[(String, bool)]) -> Result<Vec<Row>, Error> {
    let family_rate = sidak(FAMILY_RATE, cells.len() * scenes.len());
    let start = Instant::now();
    let mut rows = Vec::new();
    for scene in scenes {
        let mut stage = Stage::open(scene, options)?;
        let wanted = |settings: &str| {
            options.only.as_ref().is_none_or(|text| format!("{scene}/{settings}").contains(text.as_str()))
        };
        for (settings, wrong) in cells.iter().filter(|(settings, _)| wanted(settings)) {
            let cell = Cell::new(trials, scene, settings, *wrong)?;
            let matrix = trials.known.matrix;
            let declared = options.technique.as_ref().filter(|_| cell.expected != Expected::Biased);
            let declared = declared.map(|_| Goal { image: matrix.goal(scene), tiles: matrix.tile_goal });
            let goal = options.goal.map(|image| Goal { image, tiles: f64::INFINITY }).or(declared);
            let row = stage.row(cell, goal, family_rate)?;
            eprintln!("{:.0} s: {row}", start.elapsed().as_secs_f64());
            rows.push(row);
        }
    }
    Ok(rows)
}

/// The settings of the matrix; at last the defaults once more, and whether they are to be wrong.
fn cells(trials: &Trials) -> Vec<(String, bool)> {
    let mut cells = (trials.known.matrix.cells)();
    if cells.is_empty() {
        let presets = trials.technique.presets();
        cells.push(String::new());
        cells.extend(presets.iter().map(|(name, _)| format!("preset={name}")));
    }
    cells.into_iter().map(|settings| (settings, false)).chain([(String::new(), true)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use restir_host::buffers::SceneBuffers;
    use restir_host::render::Render;
    use restir_tests::scenes::named;
    use tempfile::{TempDir, tempdir};

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        options: Options,
    }

    fn cell(cell: &str, folder: &TempDir, more: &[&str]) -> Result<(), Error> {
        let state = folder.path().to_str().unwrap();
        let few = ["unbiased", "--reference-samples", "16384", "--state", state, "--cell", cell];
        run(&Cli::try_parse_from(few.iter().chain(more)).unwrap().options)
    }

    #[test]
    fn a_cell_that_was_interrupted_ends_as_one_that_ran_through() {
        let state = |restarts: &[&str]| {
            let folder = tempdir().unwrap();
            for restarts in restarts {
                cell("path:roulette=on/furnace", &folder, &["--restarts", restarts]).unwrap();
            }
            std::fs::read_to_string(folder.path().join("path-roulette=on-furnace.json")).unwrap()
        };
        assert_eq!(state(&["512"]), state(&["256", "512"]));
    }

    #[test]
    fn right_and_wrong_are_told_from_each_other() {
        let folder = tempdir().unwrap();
        for name in ["path/furnace", "restir-di:candidates=1,spatial=0/furnace"] {
            cell(name, &folder, &["--restarts=256"]).unwrap();
            cell(name, &folder, &["--restarts=256", "--wrong"]).unwrap();
        }
    }

    #[test]
    fn cells_and_states_that_do_not_fit_are_refused() {
        let folder = tempdir().unwrap();
        std::fs::write(folder.path().join("path-furnace.json"), "{}").unwrap();
        for (name, known) in [
            ("path", "path/cornell"),
            ("path/teapot", "cornell-mitsuba"),
            ("path/statue", "too many for brute force"),
            ("path/cube", "no lights but surfaces"),
            ("path/furnace", "--fresh"),
            ("magic/cornell", "restir-di"),
            ("restir-di:magic=on/cornell", "visibility_reuse"),
            ("restir-di:mis=magic/cornell", "talbot"),
            ("restir-di/panes", "transmittance=off"),
        ] {
            let message = cell(name, &folder, &[]).unwrap_err().to_string();
            assert!(message.contains(known), "{message}");
        }
    }

    #[test]
    fn every_techniques_cells_are_sound() {
        let furnace = SceneBuffers::build(&named("furnace").unwrap()).unwrap();
        for trials in Trials::all() {
            trials.rows();
            for (scene, _) in trials.known.matrix.scenes {
                for (settings, wrong) in cells(&trials) {
                    let cell = Cell::new(&trials, scene, &settings, wrong).unwrap();
                    Render::new([SIZE; 2], cell.technique).check(&furnace).expect(&settings);
                }
            }
        }
    }
}
