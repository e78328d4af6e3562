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
    let _ = writeln!(io::stderr(), "{}", harmless(message));
}

/// The text in one line, without control characters or marks that turn the direction of what follows, and with long words
/// shortened: names from files may hold all of these.
pub(super) fn harmless(text: &str) -> String {
    let turns =
        |c: char| matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}');
    let line = text.replace(|c: char| c.is_control() || turns(c), " ");
    line.split(' ').map(shortened).collect::<Vec<_>>().join(" ")
}

/// A word with its middle left out if it is a long one.
fn shortened(word: &str) -> String {
    const MOST: usize = 320;
    const KEPT: usize = 100;
    let length = word.chars().count();
    if length <= MOST {
        return word.to_owned();
    }
    let (begin, end) = (word.chars().take(KEPT), word.chars().skip(length - KEPT));
    begin.chain("[...]".chars()).chain(end).collect()
}
