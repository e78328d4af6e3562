//! What a task can end with, and the exit code that it gives.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Why a task did not succeed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A check ran and failed; the text lists every finding. Exit code 1.
    #[error("{0}")]
    Failed(String),
    /// The task could not run here; the text says what is missing and what to do. Exit code 2.
    #[error("{0}")]
    Environment(String),
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

    /// 1 for a failed check, 2 when the task could not run.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Failed(_) => ExitCode::from(1),
            _ => ExitCode::from(2),
        }
    }
}
