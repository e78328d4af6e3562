//! A suite is a list of named checks.

use libtest_mimic::{Arguments, Failed, Trial};
use std::process::ExitCode;

/// A check: it panics or returns an error if it fails.
pub type Check = fn() -> Result<(), Failed>;

/// The checks as tests.
pub fn trials(checks: &[(&str, Check)]) -> Vec<Trial> {
    checks.iter().map(|&(name, check)| Trial::test(name, check)).collect()
}

/// Runs the checks that the command line asks for.
pub fn run(checks: &[(&str, Check)]) -> ExitCode {
    libtest_mimic::run(&Arguments::from_args(), trials(checks)).exit_code()
}

/// Fails with the given text unless the condition holds.
pub fn ensure(condition: bool, text: impl FnOnce() -> String) -> Result<(), Failed> {
    if condition { Ok(()) } else { Err(Failed::from(text())) }
}
