//! The shader compiler: where it is, and the identity that the manifest records.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};

use super::{install, tools};
use crate::Error;

/// A rust-gpu toolchain that is ready to use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Toolchain {
    /// Name of the rustup toolchain.
    pub channel: String,
    /// The backend `rustc_codegen_spirv`, a dynamic library.
    pub backend: PathBuf,
}

/// What decides the bytes of a build besides the source.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Hash of everything below: equal ids give equal bytes.
    pub id: String,
    /// Release and commit of rustc.
    pub rustc: String,
    /// Hash of the backend library.
    pub backend: String,
    /// Version line of SPIRV-Tools.
    pub spirv_tools: String,
}

impl Toolchain {
    /// The toolchain that `RUST_GPU_TOOLCHAIN` and `RUST_GPU_CODEGEN` name, else the one that cargo-gpu installed.
    pub fn find() -> Result<Option<Self>, Error> {
        let named = Self::from_variables(env::var("RUST_GPU_TOOLCHAIN").ok(), env::var_os("RUST_GPU_CODEGEN"))?;
        Ok(named.or_else(install::installed))
    }

    /// The toolchain that the two variables name; one without the other is a mistake.
    fn from_variables(channel: Option<String>, backend: Option<std::ffi::OsString>) -> Result<Option<Self>, Error> {
        match (channel.filter(|c| !c.is_empty()), backend.filter(|b| !b.is_empty()).map(PathBuf::from)) {
            (None, None) => Ok(None),
            (Some(channel), Some(backend)) if backend.is_file() => Ok(Some(Self { channel, backend })),
            (Some(_), Some(backend)) => Err(Error::Environment(format!(
                "RUST_GPU_CODEGEN names {}, which is no file: set it to the library of rustc_codegen_spirv",
                backend.display()
            ))),
            _ => Err(Error::Environment(
                "only one of RUST_GPU_TOOLCHAIN and RUST_GPU_CODEGEN is set: set both, or none to use cargo-gpu"
                    .to_owned(),
            )),
        }
    }

    /// Asks the tools who they are.
    pub fn identity(&self) -> Result<Identity, Error> {
        let rustc = rustc_version(&self.channel)?;
        let backend = hash_file(&self.backend)?;
        Ok(Identity::new(rustc, backend, tools::version()?))
    }
}

impl Identity {
    fn new(rustc: String, backend: String, spirv_tools: String) -> Self {
        let id = blake3::hash(format!("{rustc}\n{backend}\n{spirv_tools}\n").as_bytes()).to_hex()[..16].to_owned();
        Self { id, rustc, backend, spirv_tools }
    }
}

/// Release and commit as `rustc -vV` prints them; the host is left out because it does not show in the output.
fn rustc_version(channel: &str) -> Result<String, Error> {
    let unusable = |reason: String| {
        Error::Environment(format!(
            "the rustup toolchain `{channel}` cannot be used: {reason}; install it with rustup or set RUST_GPU_TOOLCHAIN"
        ))
    };
    let output = Command::new("rustc")
        .arg(format!("+{channel}"))
        .arg("-vV")
        .env_remove("RUSTUP_TOOLCHAIN")
        .output()
        .map_err(|e| unusable(e.to_string()))?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr);
        return Err(unusable(text.trim().lines().next().unwrap_or("it says nothing").to_owned()));
    }
    Ok(release_and_commit(&String::from_utf8_lossy(&output.stdout)))
}

fn release_and_commit(verbose: &str) -> String {
    let field = |name| verbose.lines().find_map(|line: &str| line.strip_prefix(name)).unwrap_or("unknown").trim();
    format!("{} ({})", field("release:"), field("commit-hash:"))
}

fn hash_file(path: &Path) -> Result<String, Error> {
    let mut hasher = blake3::Hasher::new();
    std::fs::File::open(path).and_then(|file| hasher.update_reader(file).map(drop)).map_err(Error::io("read", path))?;
    Ok(hasher.finalize().to_hex().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_variable_alone_is_refused() {
        assert!(Toolchain::from_variables(Some("x".to_owned()), None).is_err());
        assert!(Toolchain::from_variables(None, Some("x".into())).is_err());
        assert_eq!(Toolchain::from_variables(None, Some("".into())).ok(), Some(None));
    }

    #[test]
    fn a_missing_backend_is_named() {
        let error = Toolchain::from_variables(Some("x".to_owned()), Some("no/such.so".into())).unwrap_err();
        assert!(error.to_string().contains("no/such.so"), "{error}");
    }

    #[test]
    fn the_identity_leaves_the_host_out() {
        let verbose = "rustc 1.98.1\ncommit-hash: abc\nhost: x86_64-unknown-linux-gnu\nrelease: 1.98.1-nightly\n";
        assert_eq!(release_and_commit(verbose), "1.98.1-nightly (abc)");
    }

    #[test]
    fn every_part_of_the_identity_counts() {
        let id = |a: &str, b: &str, c: &str| Identity::new(a.to_owned(), b.to_owned(), c.to_owned()).id;
        let base = id("a", "b", "c");
        for other in [id("x", "b", "c"), id("a", "x", "c"), id("a", "b", "x")] {
            assert_ne!(base, other);
        }
    }
}
