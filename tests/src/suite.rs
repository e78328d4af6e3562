//! A suite is a list of named checks, and a binary runs several of them.
//!
//! Checks of the first tier run in every build. A build for development leaves the others, which take long there, to `cargo test --release`.

use libtest_mimic::{Arguments, Failed};
use std::{
    process::ExitCode,
    sync::Mutex,
    time::{Duration, Instant},
};

/// Whether this build runs the first tier alone.
const FIRST_TIER_ALONE: bool = cfg!(first_tier);

/// A check under its name. It panics or returns an error if it fails.
pub struct Trial {
    name: String,
    is_first: bool,
    is_ignored: bool,
    run: Box<dyn FnOnce() -> Result<(), Failed> + Send>,
}

impl Trial {
    /// A check that is not of the first tier.
    pub fn test<R: Outcome>(name: impl Into<String>, run: impl FnOnce() -> R + Send + 'static) -> Self {
        Self { name: name.into(), is_first: false, is_ignored: false, run: Box::new(|| run().result()) }
    }

    /// The same in the first tier.
    #[must_use]
    pub fn first(self) -> Self {
        Self { is_first: true, ..self }
    }

    /// The same, run only where it is asked for.
    #[must_use]
    pub fn with_ignored_flag(self, is_ignored: bool) -> Self {
        Self { is_ignored, ..self }
    }

    fn of_suite(self, suite: &str) -> libtest_mimic::Trial {
        let is_ignored = self.is_ignored || FIRST_TIER_ALONE && !self.is_first;
        let name = format!("{suite}::{}", self.name);
        let timed = timed(name.clone(), self.run);
        libtest_mimic::Trial::test(name, timed).with_ignored_flag(is_ignored)
    }
}

/// Checks whose times are printed.
const LISTED: usize = 10;

/// How long the checks of this process took that took more than a second.
static LONG: Mutex<Vec<(Duration, String)>> = Mutex::new(Vec::new());

/// The check, which writes down how long it took.
fn timed<T>(name: String, run: impl FnOnce() -> T) -> impl FnOnce() -> T {
    move || {
        let start = Instant::now();
        let outcome = run();
        let took = start.elapsed();
        if took > Duration::from_secs(1) {
            LONG.lock().unwrap().push((took, name));
        }
        outcome
    }
}

/// Prints the checks that took longest: where the minutes of CI are.
fn print_longest() {
    let mut long = std::mem::take(&mut *LONG.lock().unwrap());
    long.sort_by(|a, b| b.cmp(a));
    for (took, name) in long.iter().take(LISTED) {
        println!("{:6.1} s {name}", took.as_secs_f64());
    }
}

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

/// Checks under the names of their functions, in the tiers `first` and `later`. Those of a module have its name before theirs.
#[macro_export]
macro_rules! checks {
    ($($tier:ident { $($check:ident)* })+) => {
        vec![$($($crate::checks!(@ $tier stringify!($check), $check)),*),+]
    };
    ($($tier:ident $module:ident { $($check:ident)* })+) => {
        vec![$($($crate::checks!(@ $tier concat!(stringify!($module), "::", stringify!($check)), $module::$check)),*),+]
    };
    (@ first $name:expr, $check:path) => { $crate::suite::Trial::test($name, $check).first() };
    (@ later $name:expr, $check:path) => { $crate::suite::Trial::test($name, $check) };
}

/// A suite that is [`checks!`] and nothing else.
#[macro_export]
macro_rules! suite {
    ($($checks:tt)*) => {
        pub(crate) fn trials() -> Vec<$crate::suite::Trial> {
            $crate::checks! { $($checks)* }
        }
    };
}

/// The `main` of a binary of suites, which are modules.
#[macro_export]
macro_rules! suites {
    ($($suite:ident)*) => {
        fn main() -> std::process::ExitCode {
            $crate::suite::run(&[$((stringify!($suite), $suite::trials)),*])
        }
    };
}

/// What makes the checks of a suite.
pub type Suite = fn() -> Vec<Trial>;

/// Runs the checks that the command line asks for, each under the name of its suite and its own. One that asks for checks of a suite by
/// `suite::` does not make those of others.
pub fn run(suites: &[(&str, Suite)]) -> ExitCode {
    let arguments = Arguments::from_args();
    let asked = arguments.filter.as_deref().and_then(|filter| filter.split_once("::")).map(|(suite, _)| suite);
    let one = suites.iter().position(|(suite, _)| asked == Some(suite));
    let chosen = one.map_or(suites, |one| &suites[one..=one]);
    let trials = chosen.iter().flat_map(|(suite, trials)| trials().into_iter().map(|trial| trial.of_suite(suite)));
    let conclusion = libtest_mimic::run(&arguments, trials.collect());
    print_longest();
    if FIRST_TIER_ALONE && conclusion.num_ignored > 0 {
        println!("{} checks are left to `cargo test --release`\n", conclusion.num_ignored);
    }
    conclusion.exit_code()
}

/// Fails with the given text unless the condition holds.
pub fn ensure(condition: bool, text: impl FnOnce() -> String) -> Result<(), Failed> {
    if condition { Ok(()) } else { Err(Failed::from(text())) }
}
