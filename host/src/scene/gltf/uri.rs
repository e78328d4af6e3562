//! Data that a URI names: in the URI itself, or in a file beside the document.

use std::io::Read;
use std::path::{Component, Path};

use super::Problem;
use super::budget::{gib, max_bytes};
use crate::input;

/// The bytes of a URI, at most `length` of them from a file. A relative URI is relative to `folder`; `what` names the
/// data in messages; `room` is what may still be read from files.
pub(super) fn bytes(
    uri: &str,
    what: &str,
    folder: Option<&Path>,
    length: u64,
    room: &mut u64,
) -> Result<Vec<u8>, Problem> {
    match uri.strip_prefix("data:") {
        Some(data) => decoded(data),
        None => read(uri, what, folder, length, room),
    }
}

fn decoded(data: &str) -> Result<Vec<u8>, Problem> {
    let (_, text) = data.split_once(";base64,").ok_or("a data URI is not in base64")?;
    base64(text).ok_or_else(|| "a data URI has broken base64".to_owned())
}

fn read(uri: &str, what: &str, folder: Option<&Path>, length: u64, room: &mut u64) -> Result<Vec<u8>, Problem> {
    let relative = percent_decoded(uri);
    if uri.contains("://") || !stays_inside(&relative) {
        return Err(format!(
            "its {what} {uri} is not a file in its folder; copy it there and refer to it by a relative URI"
        ));
    }
    let path = folder.unwrap_or(Path::new("")).join(relative);
    let problem = |error| format!("cannot read its {what} {}: {error}", path.display());
    let file = input::open(&path).map_err(problem)?;
    let length = length.min(file.metadata().map_err(problem)?.len());
    let Some(left) = room.checked_sub(length) else {
        let most = gib(max_bytes()?);
        return Err(format!(
            "the files that it refers to have more than the {most} that may be read; export a simpler scene"
        ));
    };
    *room = left;
    let mut bytes = Vec::new();
    file.take(length).read_to_end(&mut bytes).map_err(problem)?;
    Ok(bytes)
}

/// Whether a path is relative and leads nowhere out of the folder that it is relative to.
fn stays_inside(path: &str) -> bool {
    Path::new(path).components().all(|component| matches!(component, Component::Normal(_) | Component::CurDir))
}

/// Decodes base64 (RFC 4648, with or without padding).
fn base64(text: &str) -> Option<Vec<u8>> {
    let digits: Option<Vec<u32>> = text.trim_end_matches('=').bytes().map(base64_digit).collect();
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    for group in digits?.chunks(4) {
        let bits = group.iter().fold(0, |bits, digit| bits << 6 | digit) << (6 * (4 - group.len()));
        let whole_bytes = match group.len() {
            4 => 3,
            3 => 2,
            2 => 1,
            _ => return None,
        };
        bytes.extend(bits.to_be_bytes().into_iter().skip(1).take(whole_bytes));
    }
    Some(bytes)
}

fn base64_digit(byte: u8) -> Option<u32> {
    let digit = match byte {
        b'A'..=b'Z' => byte - b'A',
        b'a'..=b'z' => byte - b'a' + 26,
        b'0'..=b'9' => byte - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => return None,
    };
    Some(u32::from(digit))
}

/// Replaces `%20` and the like; what is no such escape stays.
fn percent_decoded(uri: &str) -> String {
    let mut decoded = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, tail)) = rest.split_first() {
        match escaped(first, tail) {
            Some(byte) => {
                decoded.push(byte);
                rest = tail.get(2..).unwrap_or_default();
            }
            None => {
                decoded.push(first);
                rest = tail;
            }
        }
    }
    String::from_utf8_lossy(&decoded).into_owned()
}

fn escaped(first: u8, tail: &[u8]) -> Option<u8> {
    let digit = |at: usize| tail.get(at).and_then(|&digit| char::from(digit).to_digit(16));
    let value = 16 * digit(0)? + digit(1)?;
    if first == b'%' { u8::try_from(value).ok() } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_rfc() {
        for (text, bytes) in
            [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg", "foob"), ("Zm9vYmFy", "foobar")]
        {
            assert_eq!(base64(text).unwrap(), bytes.as_bytes());
        }
        assert_eq!(base64("+/+/").unwrap(), [0xfb, 0xff, 0xbf]);
        assert_eq!(base64("Z"), None);
        assert_eq!(base64("Zm9*"), None);
    }

    #[test]
    fn percent_escapes() {
        assert_eq!(percent_decoded("a%20b%2"), "a b%2");
        assert_eq!(percent_decoded("%C3%B6%zz"), "ö%zz");
    }
}
