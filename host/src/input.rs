//! Files to read: only regular ones, for a pipe or a device may block or never end.

use std::fs::File;
use std::io;
use std::path::Path;

/// Opens the file `path`.
///
/// # Errors
/// As of [`File::open`], and for what is no regular file.
pub fn open(path: &Path) -> io::Result<File> {
    let kind = std::fs::metadata(path)?;
    if kind.is_dir() {
        return Err(io::Error::other("it is a folder; name a file in it"));
    }
    if !kind.is_file() {
        return Err(io::Error::other("it is a pipe or a device; copy its content to a file first"));
    }
    File::open(path)
}
