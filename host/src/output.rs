//! Files that appear whole or not at all: written under a temporary name in the target's folder, then renamed.
//!
//! ```
//! use restir_host::output::write_atomically;
//! use std::io::{Error, Write};
//!
//! let path = &std::env::temp_dir().join(format!("restir-output-{}", std::process::id()));
//! write_atomically(path, |file| file.write_all(b"whole"))?;
//!
//! // where writing fails half-way, the file is what it was
//! let failed = write_atomically(path, |file| file.write_all(b"ha").and_then(|()| Err(Error::other("the disk is full"))));
//! assert!(failed.unwrap_err().to_string().contains("the disk is full"));
//! assert_eq!(std::fs::read(path).unwrap(), b"whole");
//! # std::fs::remove_file(path).ok();
//! # Ok::<(), restir_host::Error>(())
//! ```

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

use crate::Error;

/// Writes the file `path` with `write`; it replaces an existing file, and only after all was written. A link stays one: what it
/// leads to is replaced. A device, a pipe or a socket is never replaced: root could, and would take it from every other program.
///
/// # Errors
/// [`Error::File`] if the folder or the file is not writable, if `path` is there and no file, or if `write` fails; then `path` is as it was before and
/// no temporary file is left.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> Result<(), Error> {
    let path = &destination(path);
    let file = temporary_beside(path)?;
    fill(file.as_file(), write).map_err(|error| Error::cannot_write(path, error))?;
    file.persist(path).map_err(|error| Error::cannot_write(path, error.error))?;
    Ok(())
}

/// Checks that [`write_atomically`] could write `path`, without leaving anything there: to be asked before long work.
///
/// # Errors
/// [`Error::File`] if the folder is missing or not writable, if `path` is there and no file, or if its name is too long.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    temporary_beside(&destination(path))?;
    match std::fs::symlink_metadata(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::cannot_write(path, error)),
        _ => Ok(()),
    }
}

/// The file behind a link, also one that is not there yet.
fn destination(path: &Path) -> PathBuf {
    let linked = std::fs::canonicalize(path).or_else(|_| {
        let target = std::fs::read_link(path)?;
        io::Result::Ok(path.parent().unwrap_or(Path::new(".")).join(target))
    });
    match std::fs::symlink_metadata(path) {
        Ok(entry) if entry.is_symlink() => linked.unwrap_or_else(|_| path.to_owned()),
        _ => path.to_owned(),
    }
}

fn fill(file: &File, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> io::Result<()> {
    let mut buffered = BufWriter::new(file);
    write(&mut buffered)?;
    buffered.flush()
}

fn temporary_beside(path: &Path) -> Result<NamedTempFile, Error> {
    if path.is_dir() || path.file_name().is_none() {
        return Err(Error::cannot_write(path, "it is a folder; name a file in it"));
    }
    if path.exists() && !path.is_file() {
        return Err(Error::cannot_write(path, "it is a device, a pipe or a socket; name a file"));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let cannot_write = |why: &str| Error::cannot_write(path, format!("the folder {} {why}", folder.display()));
    if !folder.is_dir() {
        return Err(cannot_write("does not exist; create it first"));
    }
    let mut builder = Builder::new();
    builder.prefix(".restir-").suffix(".tmp");
    // A temporary file is private by default; the result should have a new file's usual permissions.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder).map_err(|error| cannot_write(&format!("is not writable ({})", error.kind())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(folder: &Path) -> usize {
        std::fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.exr");
        write_atomically(&path, |file| file.write_all(b"old")).unwrap();
        let failed = write_atomically(&path, |file| {
            file.write_all(b"new")?;
            Err(io::Error::other("no more"))
        });
        assert!(failed.unwrap_err().to_string().contains("no more"));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(entries(folder.path()), 1);
    }

    #[test]
    #[cfg(unix)]
    fn a_link_stays_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let [link, file] = ["link.exr", "file.exr"].map(|name| folder.path().join(name));
        std::os::unix::fs::symlink("file.exr", &link).unwrap();
        for text in ["made", "replaced"] {
            check_writable(&link).unwrap();
            write_atomically(&link, |file| file.write_all(text.as_bytes())).unwrap();
            assert_eq!(std::fs::read_to_string(&file).unwrap(), text);
        }
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(entries(folder.path()), 2);
    }

    #[test]
    #[cfg(unix)]
    fn what_is_no_file_is_not_replaced() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        let [socket, link] = ["socket", "link"].map(|name| folder.path().join(name));
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        std::os::unix::fs::symlink("socket", &link).unwrap();
        for path in [&socket, &link] {
            let checked = check_writable(path).unwrap_err();
            let written = write_atomically(path, |file| file.write_all(b"gone")).unwrap_err();
            assert!([checked, written].iter().all(|error| error.to_string().contains("socket")));
        }
        assert!(std::fs::symlink_metadata(&socket).unwrap().file_type().is_socket());
        assert_eq!(entries(folder.path()), 2);
    }

    #[test]
    fn the_check_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        check_writable(&folder.path().join("image.exr")).unwrap();
        assert_eq!(entries(folder.path()), 0);
        check_writable(folder.path()).unwrap_err();
        check_writable(&folder.path().join("missing/image.exr")).unwrap_err();
        check_writable(Path::new("/")).unwrap_err();
        check_writable(&folder.path().join("x".repeat(300))).unwrap_err();
        assert_eq!(entries(folder.path()), 0);
    }
}
