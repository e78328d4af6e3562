//! What all reports have in common: where they go, and the verdict.

use std::io::Write;
use std::path::Path;

use restir_host::output::write_atomically;

use crate::Error;

/// Prints a report, and puts it into `docs` where asked.
pub(crate) fn publish(name: &str, report: &str, is_wanted: bool) -> Result<(), Error> {
    println!("{report}");
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("docs");
    if is_wanted { write(&docs.join(name).with_extension("md"), report) } else { Ok(()) }
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
