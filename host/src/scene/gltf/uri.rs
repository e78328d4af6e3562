//! Data that a URI names: in the URI itself, or in a file beside the document.

use std::io::Read;
use std::path::{Component, Path, PathBuf};

use base64::alphabet;
use base64::engine::{DecodePaddingMode, Engine, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::Problem;
use super::budget::max_bytes;
use crate::error::ensure;
use crate::error::gib;
use crate::input;

/// What a URI begins with that holds its data, in letters of any case.
const DATA: &str = "data:";
/// What it has before a comma and its data.
const BASE64_KIND: &str = ";base64";

/// The bytes of a URI, at most `length` of them. A relative URI is relative to `folder`; `what` names the
/// data in messages; `room` is what may still be read from files.
pub(super) fn bytes(
    uri: &str,
    what: &str,
    folder: Option<&Path>,
    length: usize,
    room: &mut u64,
) -> Result<Vec<u8>, Problem> {
    if is_data(uri) {
        let (kind, text) = uri.split_once(',').unwrap_or((uri, ""));
        let is_base64 = kind.to_ascii_lowercase().ends_with(BASE64_KIND);
        ensure!(is_base64, "a data URI is not in base64");
        let mut bytes = BASE64.decode(text).map_err(|_| "a data URI has broken base64")?;
        bytes.truncate(length);
        return Ok(bytes);
    }
    let path = file(uri, folder).ok_or_else(|| {
        format!("its {what} {uri} is not a file in its folder; copy it there and refer to it by a relative URI")
    })?;
    let problem = |error| format!("cannot read its {what} {}: {error}", path.display());
    let file = input::open(&path).map_err(problem)?;
    let length = file.metadata().map_err(problem)?.len().min(length as u64);
    let most = gib(max_bytes());
    ensure!(
        length <= *room,
        "the files that it refers to have more than the {most} that may be read; export a simpler scene"
    );
    *room -= length;
    let mut bytes = Vec::new();
    file.take(length).read_to_end(&mut bytes).map_err(problem)?;
    Ok(bytes)
}

/// The file of a relative URI that leads nowhere out of `folder`.
pub(super) fn file(uri: &str, folder: Option<&Path>) -> Option<PathBuf> {
    let relative = percent_decode_str(uri).decode_utf8_lossy();
    let inside = !is_data(uri) && !uri.contains("://") && stays_inside(&relative);
    inside.then(|| folder.unwrap_or(Path::new("")).join(&*relative))
}

fn is_data(uri: &str) -> bool {
    uri.get(..DATA.len()).is_some_and(|scheme| scheme.eq_ignore_ascii_case(DATA))
}

/// Whether a path is relative and leads nowhere out of the folder that it is relative to.
fn stays_inside(path: &str) -> bool {
    Path::new(path).components().all(|component| matches!(component, Component::Normal(_) | Component::CurDir))
}

/// Base64 of RFC 4648, with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_with_and_without_padding() {
        for text in ["Zm9vYg==", "Zm9vYg"] {
            assert_eq!(BASE64.decode(text).unwrap(), b"foob");
        }
        assert!(BASE64.decode("Z").is_err() && BASE64.decode("Zm9*").is_err());
    }
}
