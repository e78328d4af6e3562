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
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use tempfile::{Builder, NamedTempFile};

use crate::error::{Error, explained};

/// How much is in the making that is not whole yet: files, and folders that are made for them.
static IN_THE_MAKING: Mutex<usize> = Mutex::new(0);
static MADE: Condvar = Condvar::new();

fn in_the_making() -> MutexGuard<'static, usize> {
    IN_THE_MAKING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// While it lives, files are in the making, and [`settled`] waits. Each file of this library has its own.
#[doc(hidden)]
#[derive(Debug)]
#[must_use]
pub struct Making(());

/// Files are in the making from now on: for those that belong together, or to folders that are made for them.
#[doc(hidden)]
pub fn making() -> Making {
    *in_the_making() += 1;
    Making(())
}

impl Drop for Making {
    fn drop(&mut self) {
        *in_the_making() -= 1;
        MADE.notify_all();
    }
}

/// While it lives, no file is begun.
#[doc(hidden)]
#[derive(Debug)]
#[must_use]
pub struct Settled(#[expect(dead_code, reason = "it is held")] MutexGuard<'static, usize>);

/// Waits until all files are whole, and has none begun: for a program that a signal ends, so that it leaves no part of a file.
#[doc(hidden)]
pub fn settled() -> Settled {
    Settled(MADE.wait_while(in_the_making(), |making| *making > 0).unwrap_or_else(PoisonError::into_inner))
}

/// Writes the file `path` with `write`; it replaces an existing file, and only after all was written. A link stays one: what it
/// leads to is replaced. A device, a pipe or a socket is never replaced: root could, and would take it from every other program.
///
/// # Errors
/// [`Error::File`] if the folder or the file is not writable, if `path` is there and no file, or if `write` fails; then `path` is as it was before and
/// no temporary file is left.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> Result<(), Error> {
    let path = &destination(path);
    let _making = making();
    let file = temporary_beside(path)?;
    fill(file.as_file(), write).map_err(|error| Error::cannot_write(path, error))?;
    file.persist(path).map_err(|error| Error::cannot_write(path, error.error))?;
    Ok(())
}

/// As [`write_atomically`], with a hash (BLAKE3) of all that `fill` puts behind it.
pub(crate) fn write_hashed(
    path: &Path,
    fill: impl FnOnce(&mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()>,
) -> Result<(), Error> {
    write_atomically(path, |file| {
        let mut hasher = blake3::Hasher::new();
        fill(&mut |bytes| {
            hasher.update(bytes);
            file.write_all(bytes)
        })?;
        file.write_all(hasher.finalize().as_bytes())
    })
}

/// Checks that [`write_atomically`] could write `path`, without leaving anything there: to be asked before long work.
///
/// # Errors
/// [`Error::File`] if the folder is missing or not writable, if `path` is there and no file, or if its name is too long.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    let _making = making();
    temporary_beside(&destination(path))?;
    match std::fs::symlink_metadata(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::cannot_write(path, error)),
        _ => Ok(()),
    }
}

/// Checks that files of these `names` could be written into a folder, which need not be there: it is made for a moment.
///
/// # Errors
/// [`Error::File`] if the folder cannot be made, and as of [`check_writable`].
pub fn check_writable_in<'a>(folder: &Path, names: impl IntoIterator<Item = &'a str>) -> Result<(), Error> {
    let _making = making();
    let missing: Vec<&Path> = folder.ancestors().take_while(|above| !above.exists()).collect();
    let checked =
        make_folder(folder).and_then(|()| names.into_iter().try_for_each(|name| check_writable(&folder.join(name))));
    // from the innermost on
    missing.iter().for_each(|folder| drop(std::fs::remove_dir(folder)));
    checked
}

/// Makes a folder and those above it, if they are not there.
///
/// # Errors
/// [`Error::File`] if that cannot be.
pub fn make_folder(folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|error| Error::cannot_write(folder, error))
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
    let sentence = |why: &str| format!("the folder {} {why}", folder.display());
    if !folder.is_dir() {
        return Err(Error::cannot_write(path, sentence("does not exist; create it first")));
    }
    let mut builder = Builder::new();
    builder.prefix(".restir-").suffix(".tmp");
    // A temporary file is private by default; the result should have a new file's usual permissions.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder).map_err(|error| {
        let sentence = sentence(&format!("is not writable ({})", error.kind()));
        Error::cannot_write(path, explained(sentence, error))
    })
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
    fn the_check_of_a_folder_leaves_nothing() {
        let place = tempfile::tempdir().unwrap();
        check_writable_in(&place.path().join("a/b"), ["image.exr", "report.md"]).unwrap();
        check_writable_in(&place.path().join("a/b"), ["missing/image.exr"]).unwrap_err();
        assert_eq!(entries(place.path()), 0);
        check_writable_in(place.path(), ["image.exr"]).unwrap();
        std::fs::write(place.path().join("file"), "text").unwrap();
        check_writable_in(&place.path().join("file/a"), []).unwrap_err();
        assert_eq!(entries(place.path()), 1);
    }

    /// Who ends the program waits for all that belongs together, also for files within, and lets none begin after it.
    #[test]
    fn all_is_whole_when_it_is_settled() {
        use std::sync::mpsc::channel;
        use std::time::Duration;
        let place = tempfile::tempdir().unwrap();
        let path = |name: &str| place.path().join(name);
        let outer = making();
        let ((say, hear), (release, released)) = (channel(), channel::<()>());
        let ending = std::thread::spawn(move || {
            let settled = settled();
            say.send(()).unwrap();
            released.recv().unwrap();
            drop(settled);
        });
        let is_settled = |after: u64| hear.recv_timeout(Duration::from_millis(after)).is_ok();
        assert!(!is_settled(50));
        // within what is in the making, others are still begun
        write_atomically(&path("first"), |file| file.write_all(b"whole")).unwrap();
        assert!(!is_settled(50));
        drop(outer);
        assert!(is_settled(60_000));
        let late = std::thread::scope(|scope| {
            let target = path("late");
            let late = scope.spawn(move || write_atomically(&target, |file| file.write_all(b"late")));
            std::thread::sleep(Duration::from_millis(50));
            assert_eq!(entries(place.path()), 1);
            release.send(()).unwrap();
            late.join().unwrap()
        });
        late.unwrap();
        ending.join().unwrap();
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
