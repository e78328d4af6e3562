//! `cargo xtask mutate`: mutated files and command lines, more of them than the tests run. The cases are those of the suite `program` of
//! the crate `restir` (`mutation`), which has the program at hand.

use std::path::PathBuf;
use std::process::Command;

use clap::Args;

use crate::Error;
use crate::process::finish;

/// Options of `cargo xtask mutate`.
#[derive(Args)]
pub struct Options {
    /// How many cases.
    #[arg(long, default_value = "100000")]
    cases: u64,
    /// Begin no further case after so many seconds.
    #[arg(long)]
    seconds: Option<u64>,
    /// Seed of the cases.
    #[arg(long, default_value = "1")]
    seed: u64,
    /// The first case: to see a single one again, with `--cases 1`.
    #[arg(long, default_value = "0")]
    first: u64,
    /// Cases that run at the same time.
    #[arg(long, default_value = "2")]
    threads: u64,
    /// Keep the files of cases that show a fault in this folder.
    #[arg(long, default_value = "mutations")]
    keep: PathBuf,
}

/// Runs them.
///
/// # Errors
/// [`Error::Failed`] for a panic, an abort, a hang, a part of a file, or any other fault.
pub fn run(options: &Options) -> Result<(), Error> {
    let Options { cases, seconds, seed, first, threads, keep } = options;
    let keep = std::path::absolute(keep).map_err(Error::io("find", keep))?;
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(["test", "--release", "--locked", "--package", "restir-cli", "--test", "program"]);
    command.args(["mutation::mutated", "--", "--nocapture"]);
    let numbers = [("CASES", Some(cases)), ("SECONDS", seconds.as_ref()), ("SEED", Some(seed)), ("FIRST", Some(first))];
    for (name, number) in numbers.into_iter().chain([("THREADS", Some(threads))]) {
        command.envs(number.map(|number| (format!("RESTIR_MUTATION_{name}"), number.to_string())));
    }
    finish(command.env("RESTIR_MUTATION_KEEP", keep))
}
