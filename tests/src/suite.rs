//! A suite is a list of named checks.

use libtest_mimic::{Arguments, Failed, Trial};
use std::process::ExitCode;

/// A check: it panics or returns an error if it fails.
pub type Check = fn() -> Result<(), Failed>;

/// What the function of a check returns: nothing, or an error where it may meet one.
pub trait Outcome {
    /// The same as the test's.
    fn result(self) -> Result<(), Failed>;
}

impl Outcome for () {
    fn result(self) -> Result<(), Failed> {
        Ok(())
    }
}

impl Outcome for Result<(), Failed> {
    fn result(self) -> Self {
        self
    }
}

/// Checks under the names of their functions; those of a module under its name too.
#[macro_export]
macro_rules! checks {
    ($($check:ident)*) => { [$($crate::checks!(@ stringify!($check), $check)),*] };
    ($($module:ident { $($check:ident)* })*) => {
        [$($($crate::checks!(@ concat!(stringify!($module), "::", stringify!($check)), $module::$check)),*),*]
    };
    (@ $name:expr, $check:path) => { ($name, (|| $crate::suite::Outcome::result($check())) as $crate::suite::Check) };
}

/// The `main` of a suite that is [`checks!`] and nothing else.
#[macro_export]
macro_rules! suite {
    ($($checks:tt)*) => {
        fn main() -> std::process::ExitCode {
            $crate::suite::run(&$crate::checks! { $($checks)* })
        }
    };
}

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
