//! Whether a `fast` module reaches the other shading languages: naga parses, validates and translates it.

use restir_host::language::{Language, Parsed};

/// A text of more bytes for each byte of its module is of no use: naga has written some expression again and again.
const LONGEST: usize = 5;

/// naga's name for the variable that is true in the first round only. naga declares it when it moves the end of a round to the start of the next one.
const MOVED: &str = "loop_init";

/// Findings as sentences: at most one a language.
pub fn check(bytes: &[u8], entry: &str) -> Vec<String> {
    let judged = |parsed: &Parsed, language| match parsed.write(language) {
        Ok(source) if source.text.len() > LONGEST * bytes.len() => {
            Some(format!("naga writes {} bytes of {language} for {} bytes", source.text.len(), bytes.len()))
        }
        Ok(source) if source.text.contains(MOVED) => {
            Some(format!("naga moves the end of a loop's round to where the next one begins, in {language}"))
        }
        Ok(_) => None,
        Err(finding) => Some(finding),
    };
    match Parsed::new(bytes, entry) {
        Ok(parsed) => Language::ALL.into_iter().filter_map(|language| judged(&parsed, language)).collect(),
        Err(finding) => vec![finding],
    }
}
