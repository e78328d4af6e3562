//! `cargo lab num`: the sweeps of the scalar functions, and their table in DETERMINISM.md.

use std::fs;
use std::path::Path;
use std::time::Instant;

use clap::Args;
use restir_tests::num::{Effort, Row, Sweep, markdown, sweeps};

use crate::report::write;
use crate::{Error, report};

/// The table stands between two of these lines.
const MARKER: &str = "<!-- num-table -->";

/// Options of `cargo lab num`.
#[derive(Args)]
pub struct Options {
    /// Test every input (many minutes) instead of a subset (seconds).
    #[arg(long)]
    full: bool,
    /// Replace the table in DETERMINISM.md, with --only the lines of these functions; implies --full.
    #[arg(long)]
    write: bool,
    /// Functions to test, separated by commas; `corrections` stands for the integer steps of division and roots.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
}

/// Runs the sweeps, prints their table and writes it where asked.
///
/// # Errors
/// [`Error::Failed`] if a function is worse than claimed; others if DETERMINISM.md cannot be replaced or has no place for
/// the table, or if a function is unknown.
pub fn run(options: &Options) -> Result<(), Error> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("DETERMINISM.md");
    let document = fs::read_to_string(&path).map_err(Error::io("read", &path))?;
    replace_table(&document, str::to_owned)?;
    let effort = if options.full || options.write { Effort::Full } else { Effort::Reduced };
    let sweeps = selected(&options.only)?;
    let mut rows = Vec::new();
    for (number, sweep) in (1..).zip(&sweeps) {
        let start = Instant::now();
        rows.extend(sweep.rows(effort));
        let seconds = start.elapsed().as_secs_f64();
        eprintln!("{number} of {}: {}, {seconds:.1} s", sweeps.len(), sweep.function);
    }
    println!("{}", markdown(&rows));
    report::judge("worse than claimed", rows.iter().filter(|row| !row.passed()).map(|row| row.function.to_owned()))?;
    if !options.write {
        return Ok(());
    }
    let table = |old: &str| if options.only.is_empty() { markdown(&rows) } else { merge(old, &rows) };
    write(&path, &replace_table(&document, table)?)
}

/// The sweeps of the functions named, all if none is.
fn selected(only: &[String]) -> Result<Vec<Sweep>, Error> {
    let mut sweeps = sweeps();
    let known: Vec<_> = sweeps.iter().map(|sweep| sweep.function).collect();
    if let Some(name) = only.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(Error::Environment(format!("there is no sweep `{name}`; there are {}", known.join(", "))));
    }
    sweeps.retain(|sweep| only.is_empty() || only.iter().any(|name| name == sweep.function));
    Ok(sweeps)
}

/// The lines of a table's functions replaced, in their place or, for a new function, at the end.
fn merge(table: &str, rows: &[Row]) -> String {
    let mut lines: Vec<String> = table.trim().lines().map(str::to_owned).collect();
    for group in rows.chunk_by(|a, b| a.group() == b.group()) {
        let (function, is_correction) = group[0].group();
        let is_old = |line: &String| {
            let mut cells = line.split(" | ");
            cells.next() == Some(&format!("| {function}")) && (cells.next() == Some("correction")) == is_correction
        };
        let place = lines.iter().position(is_old).unwrap_or(lines.len());
        lines.retain(|line| !is_old(line));
        lines.splice(place..place, group.iter().map(Row::to_string));
    }
    lines.join("\n") + "\n"
}

/// The document with another table between its markers.
fn replace_table(document: &str, table: impl FnOnce(&str) -> String) -> Result<String, Error> {
    match document.split(MARKER).collect::<Vec<_>>()[..] {
        [before, old, after] => Ok(format!("{before}{MARKER}\n{}{MARKER}{after}", table(old))),
        _ => Err(Error::Environment(format!("DETERMINISM.md needs exactly two lines {MARKER} around the table"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_table_is_replaced() {
        let document = "a\n<!-- num-table -->\nold\n<!-- num-table -->\nb\n";
        let replaced = replace_table(document, |_| "new\n".to_owned()).unwrap();
        assert_eq!(replaced, "a\n<!-- num-table -->\nnew\n<!-- num-table -->\nb\n");
        assert_eq!(replace_table(&replaced, |_| "new\n".to_owned()).unwrap(), replaced);
    }

    #[test]
    fn a_document_without_markers_is_refused() {
        assert!(replace_table("text", str::to_owned).is_err());
        assert!(replace_table("a <!-- num-table --> b", str::to_owned).is_err());
    }

    #[test]
    fn only_the_functions_tested_are_replaced() {
        let rows = selected(&["div".to_owned()]).unwrap()[0].rows(Effort::Reduced);
        let [first, second] = [&rows[0], &rows[1]].map(Row::to_string);
        let table = "\nhead\n| div | device | old\n| div | host | old\n| div | correction | x\n| exp | both | x\n";
        let merged = merge(table, &rows);
        assert_eq!(merged, format!("head\n{first}\n{second}\n| div | correction | x\n| exp | both | x\n"));
        assert_eq!(merge(&merged, &rows), merged);
        assert_eq!(merge("head\n", &rows), format!("head\n{first}\n{second}\n"));
    }

    #[test]
    fn an_unknown_function_is_refused() {
        assert!(selected(&["tan".to_owned()]).is_err());
    }
}
