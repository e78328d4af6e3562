//! The buffers of a file: in its binary chunk, in `data:` URIs, or in files beside it.

use std::borrow::Cow;
use std::path::Path;

use gltf::json::Root;

use super::{Problem, uri};

/// Reads all buffers, each cut to its stated length. Relative URIs are relative to `folder`; `room` is what may still be
/// read from files.
pub(super) fn load_all<'a>(
    root: &Root,
    blob: Option<&'a [u8]>,
    folder: Option<&Path>,
    room: &mut u64,
) -> Result<Vec<Cow<'a, [u8]>>, Problem> {
    let mut buffers = Vec::new();
    for (index, buffer) in root.buffers.iter().enumerate() {
        let bytes = match (&buffer.uri, blob) {
            (Some(uri), _) => Cow::Owned(uri::bytes(uri, "buffer", folder, buffer.byte_length.0, room)?),
            (None, Some(blob)) if index == 0 => Cow::Borrowed(blob),
            (None, _) => {
                return Err(format!("buffer {index} has no data: no URI, and no binary chunk for it"));
            }
        };
        buffers.push(cut(bytes, buffer.byte_length.0, index)?);
    }
    Ok(buffers)
}

fn cut(bytes: Cow<'_, [u8]>, length: u64, index: usize) -> Result<Cow<'_, [u8]>, Problem> {
    let too_short = || format!("buffer {index} has {} bytes of the {length} that it needs", bytes.len());
    let length = usize::try_from(length).ok().filter(|&length| length <= bytes.len()).ok_or_else(too_short)?;
    Ok(match bytes {
        Cow::Borrowed(bytes) => Cow::Borrowed(bytes.get(..length).unwrap_or(bytes)),
        Cow::Owned(mut bytes) => {
            bytes.truncate(length);
            Cow::Owned(bytes)
        }
    })
}
