//! `cargo xtask package`: the published crates are whole. Packed, unpacked elsewhere and installed without the lock file, they
//! give a program whose pictures on the CPU and on an adapter have the same bits, and the tests of the host pass where they lie.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use clap::Args;

use crate::Error;
use crate::process::finish;
use crate::shader::workspace::{Workspace, scratch};

/// The crates, each after those that it depends on.
const CRATES: [&str; 5] = ["restir-shared", "restir-kernels", "restir-host", "restir", "restir-cli"];

/// A program that has the packed library as its only dependency.
const EMBEDDER: &str = include_str!("../../restir/examples/two_devices.rs");
const EMBEDDER_MANIFEST: &str = r#"[package]
name = "embedder"
edition = "2024"

[dependencies]
restir = { version = "0.1", default-features = false, features = ["exr", "gpu"] }
"#;

/// Options of `cargo xtask package`.
#[derive(Args)]
pub struct Options {
    /// Take files as they are, although they differ from the commit.
    #[arg(long)]
    allow_dirty: bool,
    /// Where the unpacked crates are built; without it, anew in a temporary folder.
    #[arg(long)]
    target_dir: Option<PathBuf>,
    /// Part of the name of the adapter; without it, the first.
    #[arg(long)]
    adapter: Option<String>,
}

/// Packs, unpacks, installs, renders and compares.
///
/// # Errors
/// [`Error::Failed`] if a step fails, as where there is no adapter, or the pictures differ.
pub fn run(options: &Options) -> Result<(), Error> {
    let folder = scratch()?;
    let place = folder.path();
    let target = options.target_dir.as_deref().map_or_else(|| Ok(place.join("target")), std::path::absolute);
    let target = target.map_err(Error::io("find", place))?;
    pack(place, options.allow_dirty)?;
    let members = unpack(place)?;
    let program = install(place, &target)?;
    let adapter = options.adapter.as_deref().map_or(["--device", "gpu"], |name| ["--adapter", name]);
    let pictures = [("cpu.exr", ["--device", "cpu"]), ("gpu.exr", adapter)];
    pictures.iter().try_for_each(|(name, device)| render(&program, &place.join(name), device))?;
    if !are_identical(&program, pictures.map(|(name, _)| place.join(name)))? {
        return Err(Error::Failed("the installed program gives other bits on the adapter than on the CPU".to_owned()));
    }
    println!(
        "{}: the pictures of the installed program on the CPU and on the adapter are identical",
        members.join(", ")
    );
    finish(cargo("run", place).args(["--release", "--package", "embedder", "--target-dir"]).arg(&target))?;
    println!("so are those of a program of {} lines that embeds the library", EMBEDDER.lines().count());
    let mut tests = cargo("test", place);
    finish(tests.args(["--release", "--package", "restir-host", "--features", "gpu", "--target-dir"]).arg(&target))?;
    println!("the tests and the examples of the packed restir-host pass");
    Ok(())
}

/// Installs the unpacked program as a user does, without the lock file; gives its path.
fn install(place: &Path, target: &Path) -> Result<PathBuf, Error> {
    let (start, root) = (Instant::now(), place.join("installed"));
    let member = member("restir-cli");
    let mut install = cargo("install", place);
    install.arg("--path").arg(&member).arg("--root").arg(&root).arg("--target-dir").arg(target);
    finish(&mut install)?;
    println!("installed by `cargo install --path {member}` in {:.0} s", start.elapsed().as_secs_f64());
    Ok(root.join("bin").join(format!("restir{}", std::env::consts::EXE_SUFFIX)))
}

/// Where a crate is unpacked.
fn member(name: &str) -> String {
    format!("{name}-{}", env!("CARGO_PKG_VERSION"))
}

fn cargo(command: &str, folder: &Path) -> Command {
    let mut cargo = Command::new("cargo");
    cargo.arg(command).current_dir(folder);
    cargo
}

/// Does what a release does, up to the upload, and keeps the packed crates. Instead of cargo's own build of each crate, the program is installed.
fn pack(place: &Path, allow_dirty: bool) -> Result<(), Error> {
    let only_packed = |command: &str, more: &[&str]| {
        let mut cargo = cargo(command, Workspace::current().root());
        cargo.args(["--no-verify", "--target-dir"]).arg(place).args(more).args(allow_dirty.then_some("--allow-dirty"));
        finish(&mut cargo)
    };
    only_packed("publish", &["--workspace", "--dry-run"])?;
    let crates: Vec<&str> = CRATES.iter().flat_map(|name| ["--package", name]).collect();
    only_packed("package", &crates)
}

/// Makes a workspace of the packed crates, in which they take each other instead of published ones; gives its members.
fn unpack(place: &Path) -> Result<Vec<String>, Error> {
    let members: Vec<String> = CRATES.map(member).into();
    for member in &members {
        finish(Command::new("tar").arg("-xzf").arg(format!("package/{member}.crate")).current_dir(place))?;
    }
    let paths = CRATES.iter().zip(&members).map(|(name, member)| format!("{name} = {{ path = {member:?} }}\n"));
    let paths: String = paths.collect();
    let all: Vec<&str> = members.iter().map(String::as_str).chain(["embedder"]).collect();
    let manifest = format!("[workspace]\nresolver = \"3\"\nmembers = {all:?}\n\n[patch.crates-io]\n{paths}");
    let files =
        [("Cargo.toml", &*manifest), ("embedder/Cargo.toml", EMBEDDER_MANIFEST), ("embedder/src/main.rs", EMBEDDER)];
    std::fs::create_dir_all(place.join("embedder/src")).map_err(Error::io("make", place))?;
    for (name, text) in files {
        let path = place.join(name);
        std::fs::write(&path, text).map_err(Error::io("write", &path))?;
    }
    Ok(members)
}

/// Renders a small picture.
fn render(program: &Path, picture: &Path, device: &[&str; 2]) -> Result<(), Error> {
    let mut command = Command::new(program);
    finish(command.args(["render", "cornell", "--size", "64x48", "--spp", "4", "-o"]).arg(picture).args(device))
}

/// Whether the pixels of two pictures have the same bits, as the program sees it.
fn are_identical(program: &Path, pictures: [PathBuf; 2]) -> Result<bool, Error> {
    let mut compare = Command::new(program);
    compare.arg("compare").args(pictures).arg("--json");
    let said = compare.output().map_err(|error| Error::Environment(format!("cannot run the program: {error}")))?;
    Ok(said.status.success() && String::from_utf8_lossy(&said.stdout).contains(r#""identical":true"#))
}
