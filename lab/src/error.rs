//! What an experiment can end with.

use std::io;
use std::path::{Path, PathBuf};

use restir_cli::ending::Ending;

/// Why an experiment did not succeed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A check ran and failed; the text lists every finding. Exit code 1.
    #[error("{0}")]
    Failed(String),
    /// The experiment could not run here; the text says what is missing and what to do. Exit code 2.
    #[error("{0}")]
    Environment(String),
    /// The library could not do its part. Exit code 2.
    #[error(transparent)]
    Host(#[from] restir_host::Error),
    /// The shader build could not do its part.
    #[error(transparent)]
    Shader(#[from] xtask::Error),
    /// A file could not be read or written. Exit code 2.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried: "read", "write"...
        action: &'static str,
        /// On which path.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

impl Error {
    /// For `map_err` on file operations.
    pub fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { action, path: path.to_owned(), source }
    }
}

impl From<Error> for Ending {
    fn from(error: Error) -> Self {
        match error {
            Error::Failed(text) | Error::Shader(xtask::Error::Failed(text)) => Self::Failed(text),
            Error::Host(error @ (restir_host::Error::Interrupted | restir_host::Error::Memory { .. })) => error.into(),
            // an experiment has no option to render elsewhere or something else, which the program would advise
            other => restir_host::Error::Setting(other.to_string()).into(),
        }
    }
}
