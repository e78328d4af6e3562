//! The binary container: a header, a chunk of JSON, and perhaps a chunk of binary data.

use super::Problem;
use crate::error::ensure;

const MAGIC: &[u8; 4] = b"glTF";
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const JSON_CHUNK: &[u8; 4] = b"JSON";
const BINARY_CHUNK: &[u8; 4] = b"BIN\0";
const CUT_OFF: &str = "the file is cut off in a chunk";

/// Splits a file into its JSON and its binary chunk; a file without the container is all JSON.
pub(super) fn split(file: &[u8]) -> Result<(&[u8], Option<&[u8]>), Problem> {
    if !file.starts_with(MAGIC) {
        return Ok((file, None));
    }
    let (version, length) = word(file, 4).zip(word(file, 8)).ok_or("the file is cut off in its header")?;
    ensure!(version == 2, "version {version} of the binary container is not supported; convert it to 2");
    let body = file.get(HEADER_BYTES..length).ok_or_else(|| {
        format!("the file is cut off: it has {} bytes of the {length} that its header announces", file.len())
    })?;
    let [kind, json, rest] = chunk(body).ok_or(CUT_OFF)?;
    ensure!(kind == JSON_CHUNK, "its first chunk is not JSON");
    if rest.is_empty() {
        return Ok((json, None));
    }
    let [kind, binary, _] = chunk(rest).ok_or(CUT_OFF)?;
    Ok((json, (kind == BINARY_CHUNK).then_some(binary)))
}

/// The kind of the first chunk, its data, and what follows it.
fn chunk(bytes: &[u8]) -> Option<[&[u8]; 3]> {
    let (header, data) = bytes.split_at_checked(CHUNK_HEADER_BYTES)?;
    let (data, rest) = data.split_at_checked(word(header, 0)?)?;
    Some([&header[4..], data, rest])
}

fn word(bytes: &[u8], at: usize) -> Option<usize> {
    let word = bytes.get(at..at + 4)?.first_chunk()?;
    usize::try_from(u32::from_le_bytes(*word)).ok()
}
