//! `cargo lab stress`: every function at the ends of its range against an `f64` shadow, and the report of it.

use std::time::Instant;

use clap::Args;
use restir_tests::stress::{Effort, frames, markdown, profiles, run as run_rows, scenes};

use crate::{Error, report};

/// Options of `cargo lab stress`.
#[derive(Args)]
pub struct Options {
    /// Test a million random inputs for each function instead of a few thousand.
    #[arg(long)]
    full: bool,
    /// Replace docs/stress.md; implies --full.
    #[arg(long)]
    write: bool,
}

/// Runs everything, prints the report and writes it where asked, also if something failed: the report shows what.
///
/// # Errors
/// [`Error::Failed`] if a function is off by more than it may; [`Error::Io`] if the report cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
    let start = Instant::now();
    let effort = if options.full || options.write { Effort::Full } else { Effort::Reduced };
    let (groups, comparisons, frames) = (run_rows(effort), scenes::run(effort), frames::run(effort));
    let tiles = profiles::run(effort);
    let report =
        [markdown(&groups), scenes::markdown(&comparisons), profiles::markdown(&tiles), frames::markdown(&frames)]
            .concat();
    eprintln!("{:.1} s", start.elapsed().as_secs_f64());
    report::publish("stress", &report, options.write)?;
    let rows = groups.iter().flat_map(|(_, rows)| rows);
    let rows = rows.filter(|(finding, _)| !finding.passed()).map(|(_, row)| row.function.name.to_owned());
    let comparisons = comparisons.into_iter().filter(|comparison| !comparison.passed()).map(|c| c.name);
    let tiles = tiles.iter().filter(|tile| !tile.passed()).map(|tile| format!("profiles of length {}", tile.length));
    report::judge("off by more than allowed", rows.chain(comparisons).chain(tiles).chain(frames.failed()))
}
