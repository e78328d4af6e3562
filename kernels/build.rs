//! Embeds the compiled kernels. A module that the manifest lists and the folder lacks is an error of this build in a
//! packaged crate and in CI. In the workspace it is one of the run: `cargo xtask`, which makes modules, depends on this
//! crate, and says so in the variable `RESTIR_MODULES`.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// What `cargo xtask shader build` writes.
const FOLDER: &str = "spirv";
const MANIFEST: &str = "manifest.json";

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_ARCH").is_ok_and(|arch| arch == "spirv") {
        return Ok(());
    }
    println!("cargo::rerun-if-changed={FOLDER}");
    let (present, missing): (Vec<String>, _) =
        listed().into_iter().partition(|file| Path::new(FOLDER).join(file).is_file());
    // cargo runs this again for as long as one of these is not there
    missing.iter().for_each(|file| println!("cargo::rerun-if-changed={FOLDER}/{file}"));
    if !missing.is_empty() && !may_be_missing() {
        println!(
            "cargo::error={FOLDER} lacks {}; run `cargo xtask shader build` in the repository of this crate",
            missing.join(", ")
        );
    }
    embed(&present)
}

/// The manifest and the modules that it lists, as paths inside the folder. They are read off its lines, which xtask
/// writes: a kernel's name is a key at the depth of two. So nobody compiles a JSON parser for this.
fn listed() -> Vec<String> {
    let manifest = fs::read_to_string(Path::new(FOLDER).join(MANIFEST)).unwrap_or_default();
    let kernels = manifest.split_once("\"kernels\": {").map_or("", |(_, kernels)| kernels);
    let names = kernels.lines().filter_map(|line| line.strip_prefix("    \"")?.strip_suffix("\": {"));
    let modules = names.flat_map(|name| ["exact", "fast"].map(|flavour| format!("{flavour}/{name}.spv")));
    [MANIFEST.to_owned()].into_iter().chain(modules).collect()
}

fn may_be_missing() -> bool {
    let is_set = |name| env::var_os(name).is_some_and(|value| !value.is_empty());
    let in_workspace = Path::new("../xtask/src/shader").is_dir();
    in_workspace && (is_set("RESTIR_MODULES") || !is_set("CI"))
}

/// Writes the table of (path, bytes) for the module `spirv`.
fn embed(files: &[String]) -> io::Result<()> {
    let row = |file: &String| {
        format!("({file:?}, include_bytes!(concat!(env!(\"CARGO_MANIFEST_DIR\"), \"/{FOLDER}/{file}\"))),\n")
    };
    let table = format!("&[\n{}]\n", files.iter().map(row).collect::<String>());
    fs::write(PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default()).join("spirv.rs"), table)
}
