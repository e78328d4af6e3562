//! Output that survives a closed pipe, which `println!` does not, and that a terminal takes for text whatever files are called.

use std::io::{self, ErrorKind, Write};
use std::path::Path;

use restir::Error;

/// Writes a result, complete with its line ends, to standard output, without marks that a terminal takes for more than text.
///
/// # Errors
/// [`Error::File`] if it cannot be written; a reader that has seen enough is no error.
pub fn print(text: &str) -> Result<(), Error> {
    let text = text.split('\n').map(plain).collect::<Vec<_>>().join("\n");
    let mut output = io::stdout().lock();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Error::cannot_write(Path::new("standard output"), error))
        }
        _ => Ok(()),
    }
}

/// Writes one line to standard error; if that fails there is nowhere left to say so.
pub fn note(message: &str) {
    let _ = writeln!(io::stderr(), "{}", harmless(message));
}

/// As [`print`], of a text that holds names from files: with what is long in its lines shortened.
///
/// # Errors
/// As of [`print`].
pub(super) fn print_shortened(text: &str) -> Result<(), Error> {
    print(&text.split('\n').map(harmless).collect::<Vec<_>>().join("\n"))
}

/// The text in one line, without control characters or marks that turn the direction of what follows, and shortened if it is long or
/// has long words: names from files may hold all of these.
pub(super) fn harmless(text: &str) -> String {
    let words: Vec<String> = plain(text).split(' ').map(|word| shortened(word, LONG_WORD)).collect();
    shortened(&words.join(" "), LONG_LINE)
}

/// A line without control characters or marks that turn the direction of what follows.
fn plain(line: &str) -> String {
    let turns = |c: char| {
        let marks = ['\u{61c}', '\u{180e}', '\u{feff}'];
        marks.contains(&c) || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}')
    };
    line.replace(|c: char| c.is_control() || turns(c), " ")
}

/// What is longer, in characters, is shortened: a word, and a line. Without names from elsewhere no message is.
const LONG_WORD: usize = 320;
const LONG_LINE: usize = 900;

/// A text of more than so many characters with its middle left out.
fn shortened(text: &str, most: usize) -> String {
    let length = text.chars().count();
    if length <= most {
        return text.to_owned();
    }
    let kept = most / 3;
    let (begin, end) = (text.chars().take(kept), text.chars().skip(length - kept));
    begin.chain("[...]".chars()).chain(end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_are_shortened_with_and_without_spaces() {
        let cases =
            [("x".repeat(5000), 300), ("ab ".repeat(2000), 1400), ("one\u{202e}two\u{61c}three\n".repeat(500), 1400)];
        for (name, most) in cases {
            let shown = harmless(&format!("error: {name}: try another"));
            assert!(shown.chars().count() < most && shown.contains("[...]"), "{shown}");
            assert!(shown.starts_with("error: ") && shown.ends_with(": try another"), "{shown}");
            assert!(!shown.contains(['\n', '\u{202e}', '\u{61c}']), "{shown}");
        }
        let usual = "error: cannot read  /a/b c.exr: it is no image";
        assert_eq!(harmless(usual), usual);
    }
}
