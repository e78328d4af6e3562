//! What can go wrong, each as one sentence that says what is wrong, where, and what to do about it.
//!
//! ```
//! use restir_host::{Error, scene::Scene};
//!
//! match Scene::load("teapot") {
//!     Err(Error::Scene { scene, problem }) => assert!(scene == "teapot" && problem.contains("cornell")),
//!     other => panic!("{other:?}"),
//! }
//! ```

use std::fmt::Display;
use std::path::{Path, PathBuf};

/// An error of this library. The program prints it as one line and exits with code 2.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("cannot {action} {}: {reason}", path.display())]
    File {
        /// "read" or "write".
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// Why, and what to do.
        reason: String,
    },
    /// A scene is broken or cannot be rendered.
    #[error("scene {scene}: {problem}")]
    Scene {
        /// Name or file of the scene.
        scene: String,
        /// What is wrong, where, and what to do.
        problem: String,
    },
    /// A setting is out of range or unknown.
    #[error("{0}")]
    Setting(String),
    /// No usable GPU adapter.
    #[error("{0}")]
    Adapter(String),
    /// A compiled kernel is missing, damaged or does not fit its descriptor.
    #[error("kernel {kernel}: {problem}")]
    Kernel {
        /// Name of the kernel.
        kernel: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// The buffers of a render do not fit.
    #[error("{0}")]
    Memory(String),
    /// A check ran and did not pass. The program exits with code 1.
    #[error("{0}")]
    Failed(String),
    /// The user interrupted the work.
    #[error("interrupted; what was in work was not written")]
    Interrupted,
}

impl Error {
    /// That a file cannot be read, and why.
    pub fn cannot_read(path: &Path, reason: impl Display) -> Self {
        Self::File { action: "read", path: path.to_owned(), reason: reason.to_string() }
    }

    /// That a file cannot be written, and why.
    pub fn cannot_write(path: &Path, reason: impl Display) -> Self {
        Self::File { action: "write", path: path.to_owned(), reason: reason.to_string() }
    }
}

/// Returns with a formatted problem unless a condition holds, as the macro of that name of `anyhow` does.
macro_rules! ensure {
    ($condition:expr, $($problem:tt)+) => {
        if !$condition {
            return Err(format!($($problem)+));
        }
    };
}
pub(crate) use ensure;
