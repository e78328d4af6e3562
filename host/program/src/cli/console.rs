//! Output that survives a closed pipe, which `println!` does not.

use std::io::{self, ErrorKind, Write};
use std::path::PathBuf;

use restir::Error;

/// Writes a result, complete with its line ends, to standard output.
///
/// # Errors
/// [`Error::File`] if it cannot be written; a reader that has seen enough is no error.
pub(super) fn print(text: &str) -> Result<(), Error> {
    let mut output = io::stdout().lock();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Error::File { action: "write", path: PathBuf::from("standard output"), reason: error.to_string() })
        }
        _ => Ok(()),
    }
}

/// Writes one line to standard error; if that fails there is nowhere left to say so.
pub(super) fn note(message: &str) {
    // Names from files may hold anything, also what moves a terminal's cursor.
    let line = message.replace(char::is_control, " ");
    let _ = writeln!(io::stderr(), "{line}");
}
