//! Suites with and without a fault.

use std::collections::BTreeSet;
use std::fmt;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::fault::Fault;
use super::tree::Tree;
use crate::Error;
use crate::process::shell;
use crate::shader::workspace::scratch;

/// Checks that take longer never end.
const LONGEST: Duration = Duration::from_secs(600);

/// What the tests make of a fault.
pub(super) enum Verdict {
    /// They see it; the first check that failed.
    Seen(String),
    /// All checks pass.
    Survives,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Seen(by) => write!(f, "seen by {by}"),
            Self::Survives => f.write_str("survives"),
        }
    }
}

/// Without a fault all checks pass.
pub(super) fn baseline(tree: &Tree, faults: &[&Fault]) -> Result<(), Error> {
    let checks: BTreeSet<(&str, &str)> = faults.iter().map(|fault| (&*fault.suite, &*fault.filter)).collect();
    for (suite, filter) in checks {
        compile(tree, suite, "what is right")?;
        if let Some(by) = first_to_fail(tree, suite, filter)? {
            return Err(Error::Failed(format!("without a fault {suite}, {filter:?}: {by} fails")));
        }
    }
    Ok(())
}

/// Compiles and runs what has to see a fault that was planted.
pub(super) fn judge(tree: &Tree, fault: &Fault) -> Result<Verdict, Error> {
    compile(tree, &fault.suite, &format!("fault {}", fault.name))?;
    Ok(first_to_fail(tree, &fault.suite, &fault.filter)?.map_or(Verdict::Survives, Verdict::Seen))
}

/// The suite, as cargo names it.
fn test(tree: &Tree, suite: &str) -> Command {
    let mut cargo = tree.cargo_test();
    match suite.strip_prefix("restir_") {
        Some(_) => cargo.args(["--lib", "--package", &suite.replace('_', "-")]),
        // not by its package, which alone has other features of what it depends on
        None => cargo.args(["--test", suite]),
    };
    cargo
}

fn compile(tree: &Tree, suite: &str, what: &str) -> Result<(), Error> {
    let mut cargo = test(tree, suite);
    let output = cargo.arg("--no-run").output();
    let output = output.map_err(|error| Error::Environment(format!("cannot run `{}`: {error}", shell(&cargo))))?;
    if output.status.success() {
        return Ok(());
    }
    Err(Error::Failed(format!("{what} does not compile: {}", String::from_utf8_lossy(&output.stderr))))
}

/// Runs the checks of a suite whose names have the filter, of which there has to be one; gives the first that fails.
fn first_to_fail(tree: &Tree, suite: &str, filter: &str) -> Result<Option<String>, Error> {
    let folder = scratch()?;
    let path = folder.path().join("output");
    let output = std::fs::File::create(&path).map_err(Error::io("make", &path))?;
    let mut cargo = test(tree, suite);
    cargo.args(["--", filter]).stdout(output).stderr(Stdio::null());
    let mut child =
        cargo.spawn().map_err(|error| Error::Environment(format!("cannot run `{}`: {error}", shell(&cargo))))?;
    let start = Instant::now();
    let status = loop {
        match child.try_wait().map_err(Error::io("wait for", &path))? {
            Some(status) => break status,
            None if start.elapsed() > LONGEST => {
                child.kill().map_err(Error::io("end", &path))?;
                return Ok(Some("a check that does not end".to_owned()));
            }
            None => sleep(Duration::from_millis(100)),
        }
    };
    let text = std::fs::read_to_string(&path).map_err(Error::io("read", &path))?;
    if !status.success() {
        return Ok(Some(first_failure(&text).unwrap_or_else(|| "a check that panics before it begins".to_owned())));
    }
    if text.lines().any(|line| line.starts_with("test result: ok. ") && !line.contains(" 0 passed")) {
        return Ok(None);
    }
    Err(Error::Failed(format!("no check of {suite} has {filter:?} in its name; correct the list")))
}

/// The name of the first check that a harness says has failed.
fn first_failure(text: &str) -> Option<String> {
    // quietly, it only lists them at the end
    let list =
        text.lines().skip_while(|line| *line != "failures:").skip(1).skip_while(|line| !line.starts_with("    "));
    let listed = text.lines().find_map(|line| line.strip_prefix("---- ")?.split(" ----").next());
    listed.or_else(|| list.map(str::trim).next()).map(|name| name.trim_end_matches(" stdout").to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_failure_is_found() {
        let mimic = "running 3 tests\nF.F\nfailures:\n\n---- a::b ----\nno\n\n---- a::c ----\nno\n\nfailures:\n    a::b\n    a::c\n";
        assert_eq!(first_failure(mimic).as_deref(), Some("a::b"));
        let own = "running 2 tests\n.F\nfailures:\n\n---- a::tests::b stdout ----\n\nthread panicked\n\nfailures:\n    a::tests::b\n";
        assert_eq!(first_failure(own).as_deref(), Some("a::tests::b"));
        assert_eq!(first_failure("running 1 test\n.\ntest result: ok. 1 passed; 0 failed"), None);
    }
}
