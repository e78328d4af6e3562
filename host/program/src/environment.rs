//! What the program takes from environment variables; the library reads none.

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use restir::Error;
use restir::advanced::memory;

const MEMORY: &str = "RESTIR_MEMORY_LIMIT_BYTES";
/// What a message about the limit of memory ends in.
pub(super) const MEMORY_HINT: &str = "; RESTIR_MEMORY_LIMIT_BYTES sets the limit";

/// The value of a variable, if it is set and not empty.
fn variable(name: &str) -> Option<OsString> {
    std::env::var_os(name).filter(|value| !value.is_empty())
}

/// Limits the memory of this process to `RESTIR_MEMORY_LIMIT_BYTES`.
///
/// # Errors
/// [`Error::Setting`] if the variable is no number.
pub(super) fn limit_memory() -> Result<(), Error> {
    variable(MEMORY).map_or(Ok(()), |value| bytes(&value).map(memory::set_limit))
}

fn bytes(value: &OsStr) -> Result<u64, Error> {
    let number = value.to_str().and_then(|text| text.parse().ok());
    number.ok_or_else(|| {
        let problem = format!("the environment variable {MEMORY} is {value:?}, no number of bytes");
        Error::Setting(format!("{problem}; give a natural number less than 2^64, or unset it"))
    })
}

/// The compiled kernels: those in the folder that `RESTIR_SHADERS` names, else the embedded ones.
#[cfg(feature = "gpu")]
pub(super) fn shaders() -> restir::Shaders {
    variable("RESTIR_SHADERS").map_or(restir::Shaders::Embedded, |folder| restir::Shaders::Folder(folder.into()))
}

/// Variables for a number of threads, as rayon has them: the first that asks for any counts.
const THREADS: [&str; 2] = ["RAYON_NUM_THREADS", "RAYON_RS_NUM_CPUS"];

/// The numbers of threads that are asked for, with who asks; 0 and what is no number ask for none in particular.
pub(super) fn threads() -> impl Iterator<Item = (&'static str, usize)> {
    THREADS.into_iter().filter_map(|name| Some((name, variable(name)?.to_str()?.parse().ok()?)))
}

/// The folder for what is kept if none is named: `RESTIR_CACHE`, else `restir` in the user's folder for caches.
pub(super) fn cache() -> Option<PathBuf> {
    let folder = |name: &str| variable(name).map(PathBuf::from);
    let user = || {
        if cfg!(windows) {
            folder("LOCALAPPDATA")
        } else if cfg!(target_os = "macos") {
            folder("HOME").map(|home| home.join("Library/Caches"))
        } else {
            folder("XDG_CACHE_HOME").or_else(|| folder("HOME").map(|home| home.join(".cache")))
        }
    };
    folder("RESTIR_CACHE").or_else(|| user().map(|folder| folder.join("restir")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_a_number() {
        assert_eq!(bytes(OsStr::new("1000")).unwrap(), 1000);
        for text in ["abc", "-1", "1e9", "8GiB", " 1", "18446744073709551616"] {
            let message = bytes(OsStr::new(text)).unwrap_err().to_string();
            assert!(message.contains(MEMORY) && message.contains(text), "{message}");
        }
    }
}
