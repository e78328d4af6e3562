//! `shader build --crate`: the kernels of a crate that is not this library's.
//!
//! They go the same way as the library's own. What is checked is what can be known of them: the numeric contract of `exact`, and whether
//! `fast` is portable. No descriptor says what their bindings are. A constant zero as an operand is told, and not refused: a scene that is written
//! into the source has many, and few results show the sign of a zero.

use std::path::{Path, PathBuf};

use super::build::{describe, files, summary, toolchain};
use super::flavour::Flavour;
use super::pipeline::{self, Modules};
use super::workspace::{MANIFEST, Workspace};
use super::{allow, module, portable, publish};
use crate::Error;

/// Builds the crate, and writes modules and their manifest into the folder `out`, which
/// `restir::Shaders::Folder` loads.
pub(super) fn run(workspace: &Workspace, folder: &Path, out: &Path, install_toolchain: bool) -> Result<(), Error> {
    let folder = std::path::absolute(folder).map_err(Error::io("find", folder))?;
    require_fast(&folder)?;
    require_modules_only(out)?;
    let toolchain = toolchain(workspace, install_toolchain)?;
    let identity = toolchain.identity()?;
    let digest = digest(&folder)?;
    let built = pipeline::build_crate(workspace, &toolchain, &folder)?;
    let (findings, zeros) = findings(&built);
    if !findings.is_empty() {
        return Err(Error::Failed(format!("nothing was written, because\n  {}", findings.join("\n  "))));
    }
    let manifest = describe(workspace, identity, digest, &built)?;
    let changed = publish::replace(out, &files(&built, &manifest)?)?;
    print!("{}", summary(&manifest));
    for (kernel, count) in zeros {
        println!(
            "{kernel}: {count} operations have a constant zero as an operand, so that drivers may lose the sign of a zero; take it from data if that matters"
        );
    }
    println!("{} {}", out.display(), if changed { "was replaced" } else { "was up to date" });
    Ok(())
}

/// What stands in the folder is replaced, so it holds nothing but what an earlier build has written.
fn require_modules_only(out: &Path) -> Result<(), Error> {
    let made = |file: &Path| file == Path::new(MANIFEST) || file.extension().is_some_and(|ending| ending == "spv");
    match publish::read_files(out)?.keys().find(|file| !made(file)) {
        None => Ok(()),
        Some(file) => Err(Error::Environment(format!(
            "{} holds {}, which no build of shaders has written, and would be lost; give an empty or a new folder",
            out.display(),
            file.display()
        ))),
    }
}

/// The crate has a feature for the flavour that is not exact.
fn require_fast(folder: &Path) -> Result<(), Error> {
    let path = folder.join("Cargo.toml");
    let text = std::fs::read_to_string(&path).map_err(Error::io("read", &path))?;
    let manifest: toml::Table =
        toml::from_str(&text).map_err(|error| Error::Environment(format!("{}: {error}", path.display())))?;
    let features = manifest.get("features").and_then(toml::Value::as_table);
    if features.is_some_and(|features| features.contains_key("fast")) {
        return Ok(());
    }
    let problem = "it has no feature `fast`, by which the kernels are built with the device's own division and roots; add \
                   `fast = [\"restir-shared/fast\"]`";
    Err(Error::Environment(format!("{}: {problem}", path.display())))
}

/// Digest of the crate's own files.
fn digest(folder: &Path) -> Result<String, Error> {
    let mut hasher = blake3::Hasher::new();
    let manifest = PathBuf::from("Cargo.toml");
    let text = std::fs::read(folder.join(&manifest)).map_err(Error::io("read", &folder.join(&manifest)))?;
    for (file, text) in publish::read_files(&folder.join("src"))?.into_iter().chain([(manifest, text)]) {
        super::digest::entry(&mut hasher, &super::digest::portable_name(&file), &text);
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// What is wrong with the modules, and how many operations of which have a constant zero.
fn findings(built: &Modules) -> (Vec<String>, Vec<(String, usize)>) {
    let (mut findings, mut zeros) = (Vec::new(), Vec::new());
    for (entry, bytes) in built {
        let found = match (entry.flavour, module::parse(bytes)) {
            (_, Err(reason)) => vec![reason],
            (Flavour::Exact, Ok(module)) => {
                let (zero, wrong): (Vec<_>, Vec<_>) =
                    allow::check(&module).into_iter().partition(allow::Violation::is_sign_of_zero);
                zeros.extend((!zero.is_empty()).then(|| (entry.kernel.clone(), zero.len())));
                wrong.iter().map(ToString::to_string).collect()
            }
            (Flavour::Fast, Ok(_)) => portable::check(bytes, &entry.kernel),
        };
        findings.extend(found.into_iter().map(|finding| format!("{entry}: {finding}")));
    }
    if built.is_empty() {
        findings.push(
            "the crate has no entry point; mark public functions with `#[spirv(compute(threads(...)))]`".to_owned(),
        );
    }
    (findings, zeros)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_with_other_files_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        assert!(require_modules_only(&folder.path().join("new")).is_ok());
        publish::write(&folder.path().join("exact/a.spv"), b"").unwrap();
        publish::write(&folder.path().join(MANIFEST), b"").unwrap();
        assert!(require_modules_only(folder.path()).is_ok());
        publish::write(&folder.path().join("src/lib.rs"), b"").unwrap();
        assert!(require_modules_only(folder.path()).unwrap_err().to_string().contains("src/lib.rs"));
    }

    #[test]
    fn a_crate_without_the_feature_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let told = |manifest: &str| {
            std::fs::write(folder.path().join("Cargo.toml"), manifest).unwrap();
            require_fast(folder.path()).map_err(|error| error.to_string())
        };
        assert!(told("[features]\nfast = []\n").is_ok());
        assert!(told("[package]\n").unwrap_err().contains("no feature `fast`"));
        assert!(told("[").unwrap_err().contains("Cargo.toml"));
    }
}
