//! Where things lie in the repository.

use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::Error;

/// The repository that this build of xtask belongs to, or one with the same folders.
#[derive(Clone, Debug)]
pub struct Workspace {
    root: PathBuf,
    target: PathBuf,
}

impl Workspace {
    /// The repository with the given root.
    pub fn new(root: impl Into<PathBuf>) -> Self {
        let root = root.into();
        let target = root.join(std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()));
        Self { root, target }
    }

    /// A copy of the repository, whose target directory is its own whatever the environment says.
    pub fn copy(root: impl Into<PathBuf>) -> Self {
        let root = root.into();
        Self { target: root.join("target"), root }
    }

    /// The repository that xtask was compiled in.
    pub fn current() -> Self {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
        Self::new(manifest.parent().unwrap_or(manifest))
    }

    /// Its root.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Cargo's target directory.
    pub fn target(&self) -> PathBuf {
        self.target.clone()
    }

    /// The crate of the entry points.
    pub fn kernels(&self) -> PathBuf {
        self.root.join("kernels")
    }

    /// The committed modules.
    pub fn spirv(&self) -> PathBuf {
        self.kernels().join("spirv")
    }
}

/// The manifest's name inside the directory of modules.
pub const MANIFEST: &str = "manifest.json";

/// A folder for intermediate files, which goes away with the value.
pub fn scratch() -> Result<TempDir, Error> {
    tempfile::tempdir().map_err(Error::io("create a folder in", &std::env::temp_dir()))
}
