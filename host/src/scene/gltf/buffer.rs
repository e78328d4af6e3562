//! The buffers of a file: in its binary chunk, in `data:` URIs, or in files beside it.

use std::borrow::Cow;
use std::path::Path;

use gltf::json::{Buffer, Root};

use super::{Problem, uri};
use crate::error::ensure;

/// Reads all buffers, each cut to its stated length. Relative URIs are relative to `folder`; `room` is what may still be
/// read from files.
pub(super) fn load_all<'a>(
    root: &Root,
    blob: Option<&'a [u8]>,
    folder: Option<&Path>,
    room: &mut u64,
) -> Result<Vec<Cow<'a, [u8]>>, Problem> {
    let load = |(index, buffer): (usize, &Buffer)| {
        let length = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
        let bytes = match (&buffer.uri, blob) {
            (Some(uri), _) => Cow::Owned(uri::bytes(uri, "buffer", folder, length, room)?),
            (None, Some(blob)) if index == 0 => Cow::Borrowed(blob.get(..length).unwrap_or(blob)),
            (None, _) => return Err(format!("buffer {index} has no data: no URI, and no binary chunk for it")),
        };
        let found = bytes.len();
        ensure!(found == length, "buffer {index} has {found} bytes of the {length} that it needs");
        Ok(bytes)
    };
    root.buffers.iter().enumerate().map(load).collect()
}
