//! The binary container: a header, a chunk of JSON, and perhaps a chunk of binary data.

use super::Problem;

const MAGIC: &[u8; 4] = b"glTF";
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const JSON_CHUNK: &[u8; 4] = b"JSON";
const BINARY_CHUNK: &[u8; 4] = b"BIN\0";

/// Splits a file into its JSON and its binary chunk; a file without the container is all JSON.
pub(super) fn split(file: &[u8]) -> Result<(&[u8], Option<&[u8]>), Problem> {
    if !file.starts_with(MAGIC) {
        return Ok((file, None));
    }
    let (version, length) = word(file, 4).zip(word(file, 8)).ok_or("the file is cut off in its header")?;
    if version != 2 {
        return Err(format!("version {version} of the binary container is not supported; convert it to 2"));
    }
    let body = file.get(HEADER_BYTES..length).ok_or_else(|| {
        format!("the file is cut off: it has {} bytes of the {length} that its header announces", file.len())
    })?;
    let (json, rest) = chunk(body)?;
    if json.kind != JSON_CHUNK {
        return Err("its first chunk is not JSON".to_owned());
    }
    if rest.is_empty() {
        return Ok((json.data, None));
    }
    let (binary, _) = chunk(rest)?;
    Ok((json.data, (binary.kind == BINARY_CHUNK).then_some(binary.data)))
}

struct Chunk<'a> {
    kind: &'a [u8],
    data: &'a [u8],
}

/// The first chunk, and what follows it.
fn chunk(bytes: &[u8]) -> Result<(Chunk<'_>, &[u8]), Problem> {
    let cut_off = || "the file is cut off in a chunk".to_owned();
    let length = word(bytes, 0).ok_or_else(cut_off)?;
    let kind = bytes.get(4..CHUNK_HEADER_BYTES).ok_or_else(cut_off)?;
    let data = bytes.get(CHUNK_HEADER_BYTES..).ok_or_else(cut_off)?;
    let (data, rest) = data.split_at_checked(length).ok_or_else(cut_off)?;
    Ok((Chunk { kind, data }, rest))
}

fn word(bytes: &[u8], at: usize) -> Option<usize> {
    let word = bytes.get(at..at + 4)?.first_chunk()?;
    usize::try_from(u32::from_le_bytes(*word)).ok()
}
