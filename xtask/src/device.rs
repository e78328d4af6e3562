//! `cargo xtask device`: the figures of a GPU, which the laboratory measures.

use std::process::{Command, ExitCode};

use clap::Args;

use crate::Error;
use crate::process::{profile, shell};

/// What `cargo lab device` takes, which is `cargo xtask device`, too.
#[derive(Args)]
#[command(disable_help_flag = true)]
pub struct Options {
    /// Handed on; --help tells what there is.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

/// Runs `cargo lab device` and ends as it does.
///
/// # Errors
/// [`Error::Environment`] if cargo cannot be run.
pub fn run(options: &Options) -> Result<ExitCode, Error> {
    let mut lab = Command::new(env!("CARGO"));
    lab.args(["run", "--quiet", "--profile", &profile(), "--bin", "lab", "--", "device"]).args(&options.arguments);
    let status = lab.status().map_err(|error| Error::Environment(format!("cannot run `{}`: {error}", shell(&lab))))?;
    // without a code a signal ended it, which its own words do not tell
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    code.map(ExitCode::from).ok_or_else(|| Error::Environment(format!("`{}` ended with {status}", shell(&lab))))
}
