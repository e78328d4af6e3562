//! `cargo xtask num`: the sweeps of the scalar functions, and their table in DETERMINISM.md.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use restir_tests::num::{Effort, markdown, rows};
use tempfile::NamedTempFile;

use crate::Error;

/// The table stands between two of these lines.
const MARKER: &str = "<!-- num-table -->";

/// Options of `cargo xtask num`.
#[derive(Args)]
pub struct Options {
    /// Test every input (minutes) instead of a subset (seconds).
    #[arg(long)]
    full: bool,
    /// Replace the table in DETERMINISM.md; implies --full.
    #[arg(long)]
    write: bool,
}

/// Runs the sweeps, prints their table and writes it where asked.
///
/// # Errors
/// [`Error::Failed`] if a function is worse than claimed; [`Error::Io`] and [`Error::Environment`] if DETERMINISM.md
/// cannot be replaced or has no place for the table.
pub fn run(options: &Options) -> Result<(), Error> {
    let document = document();
    let text = if options.write { Some(read(&document)?) } else { None };
    let start = Instant::now();
    let effort = if options.full || options.write { Effort::Full } else { Effort::Reduced };
    let rows = rows(effort);
    let table = markdown(&rows);
    println!("{table}");
    eprintln!("{:.1} s", start.elapsed().as_secs_f64());
    let failed: Vec<_> = rows.iter().filter(|row| !row.passed()).map(|row| row.function).collect();
    if !failed.is_empty() {
        return Err(Error::Failed(format!("worse than claimed: {}", failed.join(", "))));
    }
    match text {
        Some(text) => write(&document, &replace_table(&text, &table)?),
        None => Ok(()),
    }
}

fn document() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("DETERMINISM.md")
}

fn read(path: &Path) -> Result<String, Error> {
    let text = fs::read_to_string(path).map_err(Error::io("read", path))?;
    replace_table(&text, "").map(|_| text)
}

/// The document with `table` between its markers.
fn replace_table(document: &str, table: &str) -> Result<String, Error> {
    match document.split(MARKER).collect::<Vec<_>>()[..] {
        [before, _, after] => Ok(format!("{before}{MARKER}\n{table}{MARKER}{after}")),
        _ => Err(Error::Environment(format!("DETERMINISM.md needs exactly two lines {MARKER} around the table"))),
    }
}

/// Writes beside the file and renames, so that it is never half written.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), Error> {
    let io = || Error::io("write", path);
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut file = NamedTempFile::new_in(folder).map_err(io())?;
    file.write_all(text.as_bytes()).map_err(io())?;
    file.persist(path).map_err(|error| io()(error.error))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_table_is_replaced() {
        let document = "a\n<!-- num-table -->\nold\n<!-- num-table -->\nb\n";
        let replaced = replace_table(document, "new\n").unwrap();
        assert_eq!(replaced, "a\n<!-- num-table -->\nnew\n<!-- num-table -->\nb\n");
        assert_eq!(replace_table(&replaced, "new\n").unwrap(), replaced);
    }

    #[test]
    fn a_document_without_markers_is_refused() {
        assert!(replace_table("text", "new\n").is_err());
        assert!(replace_table("a <!-- num-table --> b", "new\n").is_err());
    }
}
