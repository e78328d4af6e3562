//! Whether a `fast` module reaches the other shading languages: naga parses, validates and translates it.

use restir_host::language::{Language, Parsed};

/// Findings as sentences: at most one a language.
pub fn check(bytes: &[u8], entry: &str) -> Vec<String> {
    Parsed::new(bytes, entry).map_or_else(
        |finding| vec![finding],
        |parsed| Language::ALL.into_iter().filter_map(|language| parsed.write(language).err()).collect(),
    )
}
