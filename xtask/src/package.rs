//! `cargo xtask package`: the published crates are whole. Packed, unpacked elsewhere and built without the lock file, they
//! give a program whose pictures on the CPU and on the device have the same bits, and the tests of the host pass where they lie.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use clap::Args;
use restir_host::image::read_exr;

use crate::Error;
use crate::process::finish;
use crate::shader::workspace::{Workspace, scratch};

/// The crates, each after those that it depends on.
const CRATES: [&str; 4] = ["restir-shared", "restir-kernels", "restir-host", "restir"];

/// A program that has the packed library as its only dependency.
const EMBEDDER: &str = include_str!("../../host/program/examples/two_devices.rs");
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
}

/// Packs, unpacks, builds, renders and compares.
///
/// # Errors
/// [`Error::Failed`] if a step fails or the pictures differ.
pub fn run(options: &Options) -> Result<(), Error> {
    let folder = scratch()?;
    let place = folder.path();
    let target = options.target_dir.as_deref().map_or_else(|| Ok(place.join("target")), std::path::absolute);
    let target = target.map_err(Error::io("find", place))?;
    pack(place, options.allow_dirty)?;
    let members = unpack(place)?;
    let start = Instant::now();
    finish(cargo("build", place).args(["--release", "--package", "restir", "--target-dir"]).arg(&target))?;
    let seconds = start.elapsed().as_secs_f64();
    let program = target.join("release").join(format!("restir{}", std::env::consts::EXE_SUFFIX));
    let [cpu, gpu] = [render(&program, place, "cpu")?, render(&program, place, "gpu")?];
    if cpu != gpu {
        return Err(Error::Failed("the packaged program gives other bits on the device than on the CPU".to_owned()));
    }
    println!("{}: built in {seconds:.0} s, its pictures on CPU and device are identical", members.join(", "));
    finish(cargo("run", place).args(["--release", "--package", "embedder", "--target-dir"]).arg(&target))?;
    println!("so are those of a program of {} lines that embeds it", EMBEDDER.lines().count());
    let mut tests = cargo("test", place);
    finish(tests.args(["--release", "--package", "restir-host", "--features", "gpu", "--target-dir"]).arg(&target))?;
    println!("the tests and the examples of the packed restir-host pass");
    Ok(())
}

fn cargo(command: &str, folder: &Path) -> Command {
    let mut cargo = Command::new("cargo");
    cargo.arg(command).current_dir(folder);
    cargo
}

fn pack(place: &Path, allow_dirty: bool) -> Result<(), Error> {
    let mut package = cargo("package", Workspace::current().root());
    package.args(["--no-verify", "--target-dir"]).arg(place);
    package.args(CRATES.iter().flat_map(|name| ["--package", name]));
    package.args(allow_dirty.then_some("--allow-dirty"));
    finish(&mut package)
}

/// Makes a workspace of the packed crates, in which they take each other instead of published ones; gives its members.
fn unpack(place: &Path) -> Result<Vec<String>, Error> {
    let members: Vec<String> = CRATES.map(|name| format!("{name}-{}", env!("CARGO_PKG_VERSION"))).into();
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

/// Bits of the pixels of a small picture.
fn render(program: &Path, place: &Path, device: &str) -> Result<Vec<u32>, Error> {
    let path = place.join(format!("{device}.exr"));
    let mut command = Command::new(program);
    command.args(["render", "cornell", "--size", "64x48", "--spp", "4", "--device", device, "-o"]).arg(&path);
    finish(&mut command)?;
    Ok(read_exr(&path)?.pixels.as_flattened().iter().map(|value| value.to_bits()).collect())
}
