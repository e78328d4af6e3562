//! `cargo xtask planted`: the tests see faults. Single lines of `shared/` are made wrong, one at a time, in a copy of the sources, and the suite that
//! has to see it is compiled and run. A fault that no check sees is a failure of the tests.
//!
//! The list is `xtask/src/planted/faults.toml`: equations of the papers, weights, Jacobians, and what went wrong in other libraries. Tests that compare with
//! the compiled modules or with stored bits would see any change, and are not what a fault names.

mod fault;
mod report;
mod tree;
mod trial;

use std::time::Instant;

use self::fault::Fault;
use self::report::{Report, Row};
use self::tree::Tree;
use self::trial::{Verdict, baseline, judge};
use crate::Error;
use crate::shader::workspace::Workspace;

/// Options of `cargo xtask planted`.
#[derive(clap::Args)]
pub struct Options {
    /// Only faults with one of these words in their names.
    names: Vec<String>,
    /// One fault, which the commit chooses, without first running its suite on what is right.
    #[arg(long, conflicts_with = "names")]
    today: bool,
    /// Write the verdicts into docs/planted.md; those of other faults stay.
    #[arg(long)]
    write: bool,
    /// Only print the faults, and check that each can be planted.
    #[arg(long)]
    list: bool,
}

/// Plants and judges.
///
/// # Errors
/// [`Error::Failed`] if a fault survives, cannot be planted, does not compile, or if a suite fails without one.
pub fn run(options: &Options) -> Result<(), Error> {
    let workspace = Workspace::current();
    let all = fault::read(&workspace)?;
    let chosen: Vec<&Fault> = match options.today {
        true => vec![&all[tree::commit(&workspace)?.1 as usize % all.len()]],
        false => all.iter().filter(|fault| fault.is_meant(&options.names)).collect(),
    };
    if chosen.is_empty() {
        return Err(Error::Environment(format!("no planted fault is named {:?}; --list names all", options.names)));
    }
    if options.list {
        chosen.iter().for_each(|fault| println!("{}: {} ({}, {})", fault.name, fault.because, fault.file, fault.suite));
        println!("{} faults", chosen.len());
        return Ok(());
    }
    let tree = Tree::copied(&workspace)?;
    if !options.today {
        baseline(&tree, &chosen)?;
    }
    let mut report = Report::read(&workspace, &all)?;
    let mut seen = 0;
    for (number, fault) in chosen.iter().enumerate() {
        let start = Instant::now();
        let verdict = tree.with(fault, || judge(&tree, fault))?;
        println!("{}/{} {}: {verdict} ({:.0} s)", number + 1, chosen.len(), fault.name, start.elapsed().as_secs_f64());
        seen += usize::from(matches!(verdict, Verdict::Seen(_)));
        report.set(Row::new(fault, &verdict, tree.commit()));
        if options.write {
            report.write(&workspace)?;
        }
    }
    println!("{seen} of {} planted faults are seen", chosen.len());
    if seen == chosen.len() {
        Ok(())
    } else {
        Err(Error::Failed("the tests do not see all of them, see above".to_owned()))
    }
}
