//! The second way to a toolchain: cargo-gpu downloads the compiler and builds the backend, after consent.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::toolchain::Toolchain;
use crate::Error;
use crate::process::{finish, shell};

/// Version of rust-gpu and of cargo-gpu; the kernels pin spirv-std to the same one.
const VERSION: &str = "0.10.0";
/// The compiler that this version of the backend is written for.
const CHANNEL: &str = "nightly-2026-07-03";
/// Components that cargo-gpu asks for. Without all of them it would install the toolchain again.
const COMPONENTS: &str = "cargo,rustc,rust-std,clippy,rust-src,rustc-dev,llvm-tools";

/// The commands that install everything, in order.
fn commands(kernels: &Path) -> [Command; 3] {
    let mut backend = command(&["cargo", "gpu", "install", "--auto-install-rust-toolchain", "--shader-crate"]);
    backend.arg(kernels);
    [
        command(&["rustup", "toolchain", "install", CHANNEL, "--profile", "minimal", "-c", COMPONENTS]),
        command(&["cargo", "install", "cargo-gpu", "--version", VERSION, "--locked", "--no-default-features"]),
        backend,
    ]
}

/// Cargo runs xtask with the variables of the stable toolchain, which must not reach another one.
fn command(words: &[&str]) -> Command {
    let mut command = Command::new(words[0]);
    command.args(&words[1..]).env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO");
    command
}

/// What a user reads who has no toolchain and did not consent to installing one.
pub fn consent_message(kernels: &Path) -> String {
    let commands = commands(kernels).map(|command| format!("    {}", shell(&command)));
    format!(
        "There is no rust-gpu toolchain: RUST_GPU_TOOLCHAIN and RUST_GPU_CODEGEN are not set, and cargo-gpu has not \
         installed one.\n\
         `cargo xtask shader build --install-toolchain` would download and build about 2 GB:\n  \
         the rustup toolchain {CHANNEL} with {COMPONENTS},\n  \
         the backend rustc_codegen_spirv {VERSION}, built by cargo-gpu {VERSION} into its own cache,\n\
         with these commands:\n{}\n\
         Nothing else of the project needs it: the compiled modules are committed.",
        commands.join("\n")
    )
}

/// Runs the commands; the caller has consent.
pub fn install(kernels: &Path) -> Result<Toolchain, Error> {
    for mut command in commands(kernels) {
        println!("running: {}", shell(&command));
        finish(&mut command)?;
    }
    installed().ok_or_else(|| {
        Error::Environment(format!(
            "cargo-gpu ended well, but its backend is not at {}: set RUST_GPU_TOOLCHAIN={CHANNEL} and RUST_GPU_CODEGEN \
             to the library that it built",
            cache_dir().map(|cache| backend_path(&cache)).unwrap_or_default().display()
        ))
    })
}

/// What an earlier run of cargo-gpu left.
pub fn installed() -> Option<Toolchain> {
    let backend = backend_path(&cache_dir()?);
    backend.is_file().then(|| Toolchain { channel: CHANNEL.to_owned(), backend })
}

/// Where cargo-gpu 0.10 puts the backend: a folder named after the version, its dots replaced.
fn backend_path(cache: &Path) -> PathBuf {
    let library = format!("{}rustc_codegen_spirv{}", env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX);
    cache.join("rust-gpu").join("codegen").join(VERSION.replace('.', "_")).join(library)
}

fn cache_dir() -> Option<PathBuf> {
    cache_dir_of(env::consts::OS, |name| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from))
}

/// The user's cache folder on an operating system, as the `directories` crate defines it.
fn cache_dir_of(os: &str, variable: impl Fn(&str) -> Option<PathBuf>) -> Option<PathBuf> {
    match os {
        "windows" => variable("LOCALAPPDATA"),
        "macos" => Some(variable("HOME")?.join("Library").join("Caches")),
        _ => variable("XDG_CACHE_HOME").filter(|p| p.is_absolute()).or_else(|| Some(variable("HOME")?.join(".cache"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_lines() {
        let lines = commands(Path::new("my kernels")).map(|command| shell(&command));
        assert_eq!(
            lines,
            [
                "rustup toolchain install nightly-2026-07-03 --profile minimal \
                 -c cargo,rustc,rust-std,clippy,rust-src,rustc-dev,llvm-tools",
                "cargo install cargo-gpu --version 0.10.0 --locked --no-default-features",
                "cargo gpu install --auto-install-rust-toolchain --shader-crate \"my kernels\"",
            ]
        );
    }

    #[test]
    fn the_message_says_what_how_large_and_how() {
        let message = consent_message(Path::new("kernels"));
        for part in
            [CHANNEL, "rust-src", "rustc_codegen_spirv 0.10.0", "2 GB", "--install-toolchain", "cargo gpu install"]
        {
            assert!(message.contains(part), "{part} is not in: {message}");
        }
    }

    #[test]
    fn the_cache_folder_of_each_system() {
        let set =
            |names: &'static [&'static str]| move |name: &str| names.contains(&name).then(|| Path::new("/").join(name));
        assert_eq!(cache_dir_of("linux", set(&["HOME"])), Some("/HOME/.cache".into()));
        assert_eq!(cache_dir_of("linux", set(&["HOME", "XDG_CACHE_HOME"])), Some("/XDG_CACHE_HOME".into()));
        assert_eq!(cache_dir_of("macos", set(&["HOME"])), Some("/HOME/Library/Caches".into()));
        assert_eq!(cache_dir_of("windows", set(&["LOCALAPPDATA"])), Some("/LOCALAPPDATA".into()));
        assert_eq!(cache_dir_of("linux", set(&[])), None);
    }

    #[test]
    fn the_backend_lies_in_a_folder_of_its_version() {
        let path = backend_path(Path::new("cache"));
        assert!(path.starts_with("cache/rust-gpu/codegen/0_10_0"), "{}", path.display());
    }

    #[test]
    fn the_version_is_that_of_the_kernels() {
        let manifest = include_str!("../../../Cargo.toml");
        assert!(manifest.contains(&format!("spirv-std = \"={VERSION}\"")), "spirv-std and cargo-gpu move together");
    }
}
