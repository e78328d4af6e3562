//! Output that survives a closed pipe, which `println!` does not, and that a terminal takes for text whatever files are called.

use std::io::{self, ErrorKind, Write};
use std::path::PathBuf;

use restir::Error;

/// Writes a result, complete with its line ends, to standard output, without marks that a terminal takes for more than text.
///
/// # Errors
/// [`Error::File`] if it cannot be written; a reader that has seen enough is no error.
pub(super) fn print(text: &str) -> Result<(), Error> {
    let text = text.split('\n').map(plain).collect::<Vec<_>>().join("\n");
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
    plain(text).split(' ').map(shortened).collect::<Vec<_>>().join(" ")
}

/// A line without control characters or marks that turn the direction of what follows.
fn plain(line: &str) -> String {
    let turns =
        |c: char| matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}');
    line.replace(|c: char| c.is_control() || turns(c), " ")
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
