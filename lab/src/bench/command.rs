//! `cargo lab bench`

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use restir::advanced::error::{Cause, explained};
use restir::advanced::output::{self, write_atomically};
use restir::advanced::reference::{FIRST_SEED, Goal, Picture};
use restir::advanced::{input, memory};
use restir::technique::Repeats;
use restir::{Error, buffers::SceneBuffers, exec::Executor};
use restir_cli::candidate::{Candidate, candidate, picture, refuse_twice};
use restir_cli::ending::Ending;
use restir_cli::parse::{natural, quoted, require};
use restir_cli::reference::{self, Cache, PictureArguments};
use restir_cli::scene::refuse_overwriting;
use restir_cli::{console, device, interrupt, progress::reported};

use super::against::{self, Change};
use super::report::{self, Report};
use super::table::{self, Row, Setup};
use super::{Matrix, SceneResult, error::Truth, measure, plot};
use crate::origin;

/// The part of a scene's time that its reference may take.
const REFERENCE_SHARE: f64 = 0.55;
const MAX_RESTARTS: u32 = 100_000;
/// More are a slip: the reference would need 200 times as many.
const MAX_SAMPLES: u32 = 1 << 24;
pub(crate) const REPORT: &str = "report.md";
const TABLE: &str = "report.csv";
/// Memory that a table takes for each of its characters, of which a row has a hundred.
const BYTES_PER_CHARACTER: u64 = 8;

/// Options of `cargo lab bench`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Names of built-in scenes, or .gltf or .glb files.
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// A technique to measure, alone or with settings as in path:roulette=on; may be repeated. For ReSTIR a frame
    /// counts as a sample, and the image is the mean of the frames; add the word last to the settings to judge the last
    /// frame alone.
    #[arg(long = "technique", default_value = "path", value_name = "NAME[:KEY=VALUE,...]")]
    techniques: Vec<String>,
    /// Samples per pixel at which to measure, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "1,2,4,8,16,32,64", value_parser = natural::<u32>, allow_hyphen_values = true)]
    spp: Vec<u32>,
    /// Independent images at the largest number of samples per pixel; at smaller ones as many more as take equal
    /// samples.
    #[arg(long, default_value = "8", value_parser = natural::<u32>, allow_hyphen_values = true)]
    restarts: u32,
    /// Time for each scene in seconds. The reference takes at most 55 % of it, and no image but the first two begins
    /// when it is over.
    #[arg(long, default_value = "160", value_parser = natural::<u32>, allow_hyphen_values = true)]
    seconds: u32,
    /// Samples per pixel of the reference; 200 times the largest --spp if not given.
    #[arg(long, value_parser = natural::<u64>, allow_hyphen_values = true)]
    reference_spp: Option<u64>,
    /// Folder for report.md, report.csv and a plot of each scene; it is created if needed.
    #[arg(long, default_value = "bench")]
    out: PathBuf,
    /// A report.csv of an earlier run to compare with; exits with 1 if times or errors are worse by more than chance
    /// and 5 %.
    #[arg(long)]
    against: Option<PathBuf>,
    #[command(flatten)]
    picture: PictureArguments,
    #[command(flatten)]
    cache: Cache,
    #[command(flatten)]
    device: device::DeviceArguments,
}

/// A scene that is ready to be measured.
struct Subject {
    scene: String,
    buffers: SceneBuffers,
    /// Where its plot goes.
    plot: String,
    /// What it was read from.
    files: Vec<PathBuf>,
}

/// Measures, and writes the report.
///
/// # Errors
/// [`Ending::Failed`] if something got worse than in the table that is compared with, and whatever measuring meets.
pub fn run(arguments: &Arguments) -> Result<(), Ending> {
    let matrix = matrix(arguments)?;
    let baseline = arguments.against.as_deref().map(|path| read_table(path).map(|rows| (path, rows))).transpose()?;
    let subjects = subjects(arguments, &matrix)?;
    let names = [REPORT, TABLE].into_iter().chain(subjects.iter().map(|subject| subject.plot.as_str()));
    check_output(&arguments.out, names.clone())?;
    let own = arguments.scenes.iter().flat_map(|scene| arguments.picture.additions.inputs(scene));
    let inputs = own.chain(arguments.against.as_deref());
    let inputs = inputs.chain(subjects.iter().flat_map(|subject| subject.files.iter().map(PathBuf::as_path)));
    refuse_overwriting(inputs, names.map(|name| arguments.out.join(name)))?;
    let mut device = device::open(&arguments.device)?;
    let setup = setup(device.as_ref(), matrix.picture);
    let result = |subject| measured(arguments, &matrix, subject, device.as_mut());
    let results = subjects.into_iter().map(result).collect::<Result<Vec<_>, _>>()?;
    let rows: Vec<Row> = results.iter().flat_map(|result| table::rows(&setup, result)).collect();
    let against = baseline.map(|(path, old)| (path.display().to_string(), against::compare(&old, &rows)));
    let report = Report { setup: &setup, results: &results, restarts: matrix.restarts, against };
    publish(&arguments.out, &report, &rows)?;
    report.against.as_ref().map_or(Ok(()), |(name, changes)| judge(name, changes))
}

fn matrix(arguments: &Arguments) -> Result<Matrix, Error> {
    let Arguments { restarts, reference_spp, seconds, .. } = *arguments;
    let picture = picture(&arguments.picture, &arguments.techniques)?;
    let problem =
        format_args!("--restarts {restarts} is out of range; give 2 to {MAX_RESTARTS}, so that there is a spread");
    require((2..=MAX_RESTARTS).contains(&restarts), problem)?;
    let budgets: BTreeSet<u32> = arguments.spp.iter().copied().collect();
    let problem = format_args!("--spp holds 0 samples a pixel, which make no image; give at least 1");
    require(!budgets.contains(&0), problem)?;
    for samples in &arguments.spp {
        let problem = format_args!("--spp {samples} is more than can be measured; give at most {MAX_SAMPLES}");
        require(*samples <= MAX_SAMPLES, problem)?;
    }
    let problem = format_args!("0 samples a pixel make no reference; give at least 1 to --reference-spp");
    require(reference_spp != Some(0), problem)?;
    let techniques = arguments.techniques.iter().map(|text| candidate(text, picture)).collect::<Result<Vec<_>, _>>()?;
    refuse_twice("technique", techniques.iter().map(|technique| technique.name.as_str()))?;
    let time = Duration::from_secs_f64((1.0 - REFERENCE_SHARE) * f64::from(seconds));
    let matrix = Matrix { picture, techniques, budgets: budgets.into_iter().collect(), restarts, time };
    let images = matrix.seeds();
    let problem = format_args!("{images} images need more seeds than there are; give fewer --restarts");
    require(images <= u64::from(FIRST_SEED), problem)?;
    Ok(matrix)
}

fn subjects(arguments: &Arguments, matrix: &Matrix) -> Result<Vec<Subject>, Error> {
    let subject = |path: &PathBuf| {
        let (scene, buffers) = arguments.picture.load(path, matrix.picture.size)?;
        matrix.techniques.iter().try_for_each(|technique| technique.render.check(&buffers))?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().replace([' ', '(', ')'], "-");
        Ok(Subject { scene: scene.name, buffers, plot: format!("{stem}.svg"), files: scene.files })
    };
    let subjects = arguments.scenes.iter().map(subject).collect::<Result<Vec<_>, Error>>()?;
    subjects.iter().try_for_each(|subject| check_comparable(matrix, subject))?;
    refuse_twice("scene", subjects.iter().map(|subject| subject.plot.trim_end_matches(".svg")))?;
    Ok(subjects)
}

/// Before minutes of work: can the `files` be written into the folder for results, which need not be there?
pub(crate) fn check_output<'a>(out: &Path, files: impl IntoIterator<Item = &'a str>) -> Result<(), Error> {
    output::check_writable_in(out, files).map_err(|error| match error {
        Error::File { action, path, source } if path == out => {
            Error::File { action, path, source: explained(format!("{source}; name another folder by --out"), source) }
        }
        error => error,
    })
}

/// What a report says of how it was made.
pub(crate) fn setup(executor: &dyn Executor, picture: Picture) -> Setup {
    let description = executor.describe();
    let parity = device::parity(&description);
    let adapter = description.adapter.map_or_else(String::new, |adapter| format!(", {adapter}"));
    Setup {
        command: command_line(),
        machine: origin::machine(),
        device: format!("{}{adapter}, flavour {}, self-check {parity}", description.executor, description.flavour),
        commit: origin::commit(),
        picture,
    }
}

/// Refuses what converges to something else than the reference.
fn check_comparable(matrix: &Matrix, Subject { scene, buffers, .. }: &Subject) -> Result<(), Error> {
    matrix.techniques.iter().try_for_each(|Candidate { name, render }| {
        let of_frames = render.technique.about().repeats == Repeats::Frames;
        let moves = (of_frames && buffers.is_animated()).then_some(
            "renders frames of a moving scene, and the reference shows one moment; take a scene that stands still",
        );
        let differs = moves.or_else(|| render.technique.differs_from_path(buffers));
        require(differs.is_none(), format_args!("{scene}: {name} {}", differs.unwrap_or_default()))
    })
}

/// Makes the reference of a scene, then measures.
fn measured(
    arguments: &Arguments,
    matrix: &Matrix,
    Subject { scene, buffers, plot, .. }: Subject,
    executor: &mut dyn Executor,
) -> Result<SceneResult, Error> {
    let largest = matrix.budgets.last().copied().unwrap_or(1);
    let goal = Goal {
        samples: arguments.reference_spp.unwrap_or_else(|| 200 * u64::from(largest)),
        time: Some(Duration::from_secs_f64(REFERENCE_SHARE * f64::from(arguments.seconds))),
    };
    console::note(&format!("{scene}: reference"));
    let reference = reference::make(executor, &buffers, matrix.picture, &arguments.cache, goal)?;
    let (truth, reference_samples) = (Truth::new(&reference), reference.samples());
    console::note(&format!("{scene}: {reference_samples} samples in the reference, measuring"));
    let (series, restarts) = reported("rendering", |observe| measure(executor, &buffers, matrix, &truth, observe))?;
    Ok(SceneResult { scene, plot, truth, reference_samples, series, restarts })
}

/// As the user could write it.
fn command_line() -> String {
    let arguments = std::env::args_os().skip(1).map(|argument| quoted(&argument.to_string_lossy()));
    std::iter::once("cargo lab".to_owned()).chain(arguments).collect::<Vec<_>>().join(" ")
}

fn read_table(path: &Path) -> Result<Vec<Row>, Error> {
    let fail = |cause: Cause| Error::cannot_read(path, cause);
    let file = input::open(path).map_err(|error| fail(error.into()))?;
    let length = file.metadata().map_err(|error| fail(error.into()))?.len();
    let what = format!("the table {}", path.display());
    memory::check(length.saturating_mul(BYTES_PER_CHARACTER), &what, "name a report.csv of cargo lab bench")?;
    let text = io::read_to_string(file).map_err(|error| fail(error.into()))?;
    let rows = table::from_csv(&text).and_then(|rows| match rows.is_empty() {
        true => Err("it has no rows".to_owned()),
        false => Ok(rows),
    });
    rows.map_err(|problem| fail(format!("{problem}; name a report.csv of cargo lab bench").into()))
}

/// Writes the plots and the table, then the report that refers to them.
fn publish(out: &Path, report: &Report<'_>, rows: &[Row]) -> Result<(), Error> {
    interrupt::begin_writing();
    output::make_folder(out)?;
    for result in report.results {
        let path = out.join(&result.plot);
        let plot = plot::svg(result).map_err(|problem| Error::cannot_write(&path, problem))?;
        write_text(out, &result.plot, &plot)?;
    }
    let text = report::markdown(report);
    write_text(out, TABLE, &table::to_csv(rows))?;
    write_text(out, REPORT, &text)?;
    console::print(&format!("{text}\nwrote {} and {}\n", out.join(REPORT).display(), out.join(TABLE).display()))
}

/// Writes a file into the folder for results.
pub(crate) fn write_text(out: &Path, name: &str, text: &str) -> Result<(), Error> {
    write_atomically(&out.join(name), |file| file.write_all(text.as_bytes()))
}

fn judge(name: &str, changes: &[Change]) -> Result<(), Ending> {
    let worse: Vec<String> = changes
        .iter()
        .filter(|change| change.worse())
        .map(|Change { row, .. }| format!("{} {} at {} spp", row.scene, row.technique, row.spp))
        .collect();
    if worse.is_empty() {
        return Ok(());
    }
    Err(Ending::Failed(format!("worse than {name}: {}; the report has the ratios", worse.join(", "))))
}
