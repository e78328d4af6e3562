//! `cargo lab device`: all figures of a GPU by one command, after it has shown that it gives the host's words.
//!
//! Passes are timed by the device's own clock, with as many of them in flight as fit in a submission; pipelines are made before. A part takes
//! as many measurements as its time allows, and begins nothing when that is up.

mod against;
mod bench;
mod first;
mod frames;
mod pace;
mod parity;
mod registers;
mod report;
mod rows;
mod subjects;
mod subsurface;
mod traversal;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use restir_cli::console;
use serde::{Deserialize, Serialize};

use crate::Error;
use bench::Bench;
use rows::Row;

/// Options of `cargo lab device`.
#[derive(Args)]
pub struct Options {
    /// Small images, and of each technique one preset: about a minute on a software adapter.
    #[arg(long)]
    quick: bool,
    /// Parts to measure, separated by commas; all if not given. Words are compared in any case.
    #[arg(long, value_enum, value_delimiter = ',')]
    only: Vec<Part>,
    /// Part of the name of the adapter, in any case; the first hardware adapter if not given.
    #[arg(long)]
    adapter: Option<String>,
    /// The program `lab` of another commit, which measures in turns with this one: frames, their passes, and traversal alone. Figures are medians over the turns.
    #[arg(long, value_name = "PROGRAM")]
    against: Option<PathBuf>,
    /// Write the report to docs/bench-gpu, under the adapter's name.
    #[arg(long, conflicts_with_all = ["quick", "only", "against"])]
    write: bool,
    /// Print the rows of frames, passes and traversal as lines of JSON: what `--against` starts.
    #[arg(long, hide = true, conflicts_with_all = ["against", "write"])]
    rows: bool,
    /// Print the seconds to the first picture, with pipelines kept in this folder: what the part `first` starts.
    #[arg(long, hide = true, conflicts_with_all = ["against", "write", "rows"])]
    first: Option<PathBuf>,
}

/// What is measured, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
enum Part {
    /// Techniques: a frame, or a sample.
    Frames,
    /// The kernels of these.
    Passes,
    /// Rays alone.
    Traversal,
    /// Light inside of bodies, by each method.
    Subsurface,
    /// The first picture.
    First,
    /// What kernels take of a GPU.
    Registers,
}

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Extent {
    /// Small images of what matters most.
    Quick,
    /// What matters most.
    Turn,
    /// All.
    Full,
}

impl Extent {
    /// The option that asks for it.
    fn option(self) -> Option<&'static str> {
        (self == Self::Quick).then_some("--quick")
    }
}

/// What a part has found.
#[derive(Default)]
struct Found {
    rows: Vec<Row>,
    /// A table of another form, if it has one.
    table: String,
    /// Sentences on what is left out.
    notes: Vec<String>,
}

impl Found {
    /// Says which subjects there was no time for, if any.
    fn leave_out(&mut self, subjects: &[String]) {
        if !subjects.is_empty() {
            self.notes.push(format!("Left out for want of time: {}.", subjects.join(", ")));
        }
    }
}

/// Compares words, measures, and prints the report.
///
/// # Errors
/// [`Error::Failed`] if a word differs, and then there is no report; [`Error::Environment`] for a program that does not measure;
/// [`Error::Host`] if there is no adapter, or it does not run the kernels.
pub fn run(options: &Options) -> Result<(), Error> {
    let adapter = options.adapter.as_deref();
    if let Some(folder) = &options.first {
        console::print(&format!("{}\n", first::seconds(adapter, options.extent(), folder)?))?;
        return Ok(());
    }
    if let Some(program) = &options.against {
        return against::run(options, program);
    }
    console::note("comparing the device with the host");
    let mut bench = Bench::open(adapter, options.extent())?;
    if bench.is_software() && !options.quick {
        console::note("the adapter is software, which takes long for images of this size: --quick has small ones");
    }
    let words = parity::compare(&mut bench)?;
    let parts = options.parts();
    if options.rows {
        console::print(&lines(&measured(&mut bench, &parts)?)?)?;
        return Ok(());
    }
    let found = parts.iter().map(|part| Ok((*part, part.measure(&mut bench)?))).collect::<Result<Vec<_>, Error>>()?;
    report::publish(&bench, &options.command(), &words, &found, options.write)
}

/// The rows of all these parts.
fn measured(bench: &mut Bench, parts: &[Part]) -> Result<Vec<Row>, Error> {
    let found = parts.iter().map(|part| part.measure(bench)).collect::<Result<Vec<_>, Error>>()?;
    Ok(found.into_iter().flat_map(|found| found.rows).collect())
}

fn lines(rows: &[Row]) -> Result<String, Error> {
    rows::to_lines(rows).map_err(|error| Error::Failed(format!("a figure is no number: {error}")))
}

impl Options {
    fn extent(&self) -> Extent {
        match (self.quick, self.rows) {
            (true, _) => Extent::Quick,
            (false, true) => Extent::Turn,
            (false, false) => Extent::Full,
        }
    }

    /// The command that has these options.
    fn command(&self) -> String {
        let option = self.extent().option().map(|option| format!(" {option}"));
        let only: Vec<String> = self.only.iter().map(|part| part.option()).collect();
        let only = (!only.is_empty()).then(|| format!(" --only {}", only.join(",")));
        format!("cargo xtask device{}{}", option.unwrap_or_default(), only.unwrap_or_default())
    }

    /// The parts that are asked for, in their order.
    fn parts(&self) -> Vec<Part> {
        let of_turns = [Part::Frames, Part::Traversal];
        let all = if self.rows { &of_turns } else { Part::value_variants() };
        all.iter().copied().filter(|part| self.wants(*part)).collect()
    }

    /// Passes and frames are measured together.
    fn wants(&self, part: Part) -> bool {
        let asked = |part| self.only.contains(&part);
        match part {
            Part::Passes => false,
            _ if self.only.is_empty() => true,
            Part::Frames => asked(Part::Frames) || asked(Part::Passes),
            _ => asked(part),
        }
    }
}

impl Part {
    fn measure(self, bench: &mut Bench) -> Result<Found, Error> {
        console::note(&format!("measuring: {}", self.title()));
        let found = self.found(bench)?;
        match found.rows.iter().find(|row| !row.value.is_finite()) {
            Some(Row { subject, column, .. }) => Err(Error::Failed(format!(
                "{subject}: \"{column}\" is no number, because the device's clock counted no time; measure again"
            ))),
            None => Ok(found),
        }
    }

    fn found(self, bench: &mut Bench) -> Result<Found, Error> {
        match self {
            Self::Frames | Self::Passes => frames::measure(bench),
            Self::Traversal => traversal::measure(bench),
            Self::Subsurface => subsurface::measure(bench),
            Self::First => first::measure(bench),
            Self::Registers => registers::measure(bench),
        }
    }

    /// As headings of reports have it.
    fn title(self) -> &'static str {
        match self {
            Self::Frames => "Techniques",
            Self::Passes => "Passes",
            Self::Traversal => "Traversal alone",
            Self::Subsurface => "Light inside of bodies, at equal time",
            Self::First => "The first picture",
            Self::Registers => "Registers",
        }
    }
}
