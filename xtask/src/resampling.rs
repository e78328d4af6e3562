//! `cargo xtask resampling`: every form of MIS on the table of lights, and the report of it.

use std::path::Path;
use std::time::Instant;

use clap::Args;
use restir_tests::resampling::setting::Setting;
use restir_tests::resampling::{line, report, toys, trials};
use restir_tests::stats::Moments;

use crate::{Error, num};

/// Options of `cargo xtask resampling`.
#[derive(Args)]
pub struct Options {
    /// Trials of a row; fewer where they cost more.
    #[arg(long, default_value_t = 1_000_000)]
    trials: u64,
    /// Replace docs/resampling.md; implies 10^8 trials.
    #[arg(long)]
    write: bool,
}

/// Trials of a row of the report.
const REPORT_TRIALS: u64 = 100_000_000;
/// How many times fewer there are in a setting whose figures are published nowhere.
const OTHERS: u64 = 10;
/// How many times fewer of samples with a Jacobian, of which the report says nothing.
const SHIFTED: u64 = 10;
/// How many times fewer of the chains, which cost the most.
const CHAINS: u64 = 100;
/// Standard errors that a row of those may be off: one of 42 right ones is with probability 0.003.
const SHIFTED_LIMIT: f64 = 4.0;
/// The first seed of the report; the suite has another.
const SEED: u64 = 1;

/// Runs all rows, prints the report and writes it where asked, also if a row is off: the report shows which.
///
/// # Errors
/// [`Error::Failed`] if a row is off by more than 3 standard errors; [`Error::Io`] if the report cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
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
    let text = report::markdown(&rows, &toys);
    println!("{text}");
    if options.write {
        num::write(&Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("docs").join("resampling.md"), &text)?;
    }
    let shifted = line::run(SEED, trials / SHIFTED);
    let z = |measured: &Moments| (measured.mean() - 1.0) / measured.standard_error();
    for (name, measured) in &shifted {
        println!("{name}: {:.5} +- {:.5}", measured.mean(), measured.standard_error());
    }
    let shifted =
        shifted.iter().filter(|(_, measured)| z(measured).abs() > SHIFTED_LIMIT).map(|(name, _)| name.clone());
    let rows = rows.iter().filter(|row| !row.passed());
    let rows = rows.map(|row| format!("{} ({})", row.form.name(), row.setting.name()));
    let toys = toys.iter().filter(|toy| !toy.passed()).map(|toy| toy.name.clone());
    let failed: Vec<_> = rows.chain(toys).chain(shifted).collect();
    if failed.is_empty() { Ok(()) } else { Err(Error::Failed(format!("not as computed: {}", failed.join("; ")))) }
}
