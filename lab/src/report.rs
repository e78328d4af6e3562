//! What all reports have in common: where they go, and the verdict.

use std::io::Write;
use std::path::{Path, PathBuf};

use restir_host::output::write_atomically;

use crate::Error;

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("docs").join(name).with_extension("md")
}

/// Prints a report, and puts it into `docs` where asked.
pub(crate) fn publish(name: &str, report: &str, is_wanted: bool) -> Result<(), Error> {
    println!("{report}");
    if is_wanted { write(&path(name), report) } else { Ok(()) }
}

/// A report as it is in `docs`.
pub(crate) fn committed(name: &str) -> Result<String, Error> {
    let path = path(name);
    std::fs::read_to_string(&path).map_err(Error::io("read", &path))
}

/// Writes a file whole or not at all.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), Error> {
    Ok(write_atomically(path, |file| file.write_all(text.as_bytes()))?)
}

/// An error if anything failed; `what` says how.
pub(crate) fn judge(what: &str, failed: impl IntoIterator<Item = String>) -> Result<(), Error> {
    let failed: Vec<_> = failed.into_iter().collect();
    if failed.is_empty() { Ok(()) } else { Err(Error::Failed(format!("{what}: {}", failed.join("; ")))) }
}
