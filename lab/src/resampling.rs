//! `cargo lab resampling`: every form of MIS on the table of lights, or on samples with a Jacobian, and the report of it.

use std::time::Instant;

use clap::Args;
use restir_tests::resampling::line::Jacobian;
use restir_tests::resampling::setting::Setting;
use restir_tests::resampling::shifted::{Measured, WRONG};
use restir_tests::resampling::{self, shifted, toys, trials};

use crate::{Error, report};

/// Options of `cargo lab resampling`.
#[derive(Args)]
pub struct Options {
    /// Trials of a row; fewer where they cost more.
    #[arg(long, default_value_t = 1_000_000)]
    trials: u64,
    /// Samples whose shift has a Jacobian, instead of the table of lights.
    #[arg(long)]
    shifts: bool,
    /// Replace docs/resampling.md, of 10^8 trials, or docs/resampling-shifts.md, of as many as are asked for.
    #[arg(long)]
    write: bool,
}

/// Trials of a row of the report.
const REPORT_TRIALS: u64 = 100_000_000;
/// How many times fewer there are in a setting whose figures are published nowhere.
const OTHERS: u64 = 10;
/// Trials of a row of samples with a wrong Jacobian.
const WRONG_TRIALS: u64 = 25_000;
/// How many times fewer of the chains, which cost the most.
const CHAINS: u64 = 100;
/// The first seed of the report; the suite has another.
const SEED: u64 = 1;

/// Runs all rows, prints the report and writes it where asked, also if a row is off: the report shows which.
///
/// # Errors
/// [`Error::Failed`] if a row is off, or a wrong one is not; [`Error::Io`] if the report cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
    let (name, text, failed) = if options.shifts { shifts(options) } else { table(options) };
    report::publish(name, &text, options.write)?;
    report::judge("not as computed", failed)
}

/// File, text and rows that failed of the report on the table of lights.
fn table(options: &Options) -> (&'static str, String, Vec<String>) {
    let trials = if options.write { REPORT_TRIALS } else { options.trials };
    let start = Instant::now();
    let mut rows = Vec::new();
    for (seed, setting) in (SEED..).zip(Setting::ALL) {
        let share = if Setting::PUBLISHED.contains(&setting) { 1 } else { OTHERS };
        rows.extend(trials::run(seed, setting, trials / share));
        eprintln!("{}: {:.1} s", setting.name(), start.elapsed().as_secs_f64());
    }
    let toys = toys::run(SEED, trials / CHAINS);
    eprintln!("chains: {:.1} s", start.elapsed().as_secs_f64());
    let text = resampling::report::markdown(&rows, &toys);
    let rows = rows.iter().filter(|row| !row.passed());
    let rows = rows.map(|row| format!("{} ({})", row.form.name(), row.setting.name()));
    let toys = toys.iter().filter(|toy| !toy.passed()).map(|toy| toy.name.clone());
    ("resampling", text, rows.chain(toys).collect())
}

/// The same of samples with a Jacobian.
fn shifts(options: &Options) -> (&'static str, String, Vec<String>) {
    let trials = options.trials;
    let measured = |jacobian, trials| -> Vec<Measured> {
        let rows = shifted::settings(jacobian).into_iter();
        rows.map(|setting| Measured::new(setting, SEED, trials)).inspect(|row| eprintln!("{}", row.name())).collect()
    };
    let right = measured(Jacobian::Right, trials);
    let wrong: Vec<Measured> = WRONG.into_iter().flat_map(|jacobian| measured(jacobian, WRONG_TRIALS)).collect();
    let text = shifted::markdown(&right, &wrong, [trials, WRONG_TRIALS]);
    let off = right.iter().filter(|row| row.refused() != [false; 3]);
    let unseen = wrong.iter().filter(|row| row.refused() != [true; 3]);
    ("resampling-shifts", text, off.chain(unseen).map(Measured::name).collect())
}
