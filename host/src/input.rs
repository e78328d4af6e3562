//! Files to read. Only regular files are opened, for a pipe or a device may block or never end.
//!
//! ```
//! use std::io::Read;
//!
//! let path = &std::env::temp_dir().join(format!("restir-input-{}", std::process::id()));
//! std::fs::write(path, "settings")?;
//! let mut text = String::new();
//! restir_host::input::open(path)?.read_to_string(&mut text)?;
//! assert_eq!(text, "settings");
//! # std::fs::remove_file(path).ok();
//!
//! // a folder is no file, and the error says what to do
//! let error = restir_host::input::open(&std::env::temp_dir()).unwrap_err();
//! assert!(error.to_string().contains("name a file in it"));
//! # Ok::<(), std::io::Error>(())
//! ```

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
