//! `shader build`: compile, check, and replace the committed modules.

use std::collections::BTreeMap;
use std::path::PathBuf;

use restir_kernels::KernelDesc;

use super::cargo_files::LockFile;
use super::digest::source_digest;
use super::flavour::Flavour;
use super::manifest::{KernelRecord, Manifest};
use super::pipeline::{self, Modules};
use super::toolchain::{Identity, Toolchain};
use super::workspace::{MANIFEST, Workspace, module_path};
use super::{install, limits, publish, verify};
use crate::Error;

/// Libraries whose version the manifest records.
const TOOLS: [&str; 4] = ["naga", "rspirv", "spirv-builder", "spirv-std"];

/// Builds all kernels; with consent, installs a toolchain where there is none.
pub(super) fn run(workspace: &Workspace, install_toolchain: bool) -> Result<(), Error> {
    let toolchain = match Toolchain::find()? {
        Some(toolchain) => toolchain,
        None if install_toolchain => install::install(&workspace.kernels())?,
        None => return Err(Error::Environment(install::consent_message(&workspace.kernels()))),
    };
    let identity = toolchain.identity()?;
    // Taken before the build: an edit during it must not pass for built.
    let digest = source_digest(workspace)?;
    let built = pipeline::build(workspace, &toolchain)?;
    let findings = findings(&built, &restir_kernels::all());
    if !findings.is_empty() {
        return Err(Error::Failed(format!("nothing was written, because\n  {}", findings.join("\n  "))));
    }
    let manifest = describe(workspace, identity, digest, &built)?;
    let changed = publish::replace(&workspace.spirv(), &files(&built, &manifest)?)?;
    print!("{}", summary(&manifest));
    println!("{}", if changed { "kernels/spirv was replaced" } else { "kernels/spirv was up to date" });
    Ok(())
}

/// What is wrong with freshly built modules.
pub(super) fn findings(built: &BTreeMap<Flavour, Modules>, kernels: &[&KernelDesc]) -> Vec<String> {
    let mut findings = Vec::new();
    for (&flavour, modules) in built {
        findings.extend(verify::compare_entries(modules.keys().map(String::as_str), flavour, kernels));
        for kernel in kernels {
            if let Some(bytes) = modules.get(kernel.name) {
                findings.extend(verify::verify(bytes, flavour, kernel));
            }
        }
    }
    findings
}

fn describe(
    workspace: &Workspace,
    toolchain: Identity,
    source_digest: String,
    built: &BTreeMap<Flavour, Modules>,
) -> Result<Manifest, Error> {
    let lock = LockFile::read(workspace.root())?;
    let version = |name: &str| (name.to_owned(), lock.version(name).unwrap_or("unknown").to_owned());
    let mut kernels = BTreeMap::new();
    for (name, exact) in &built[&Flavour::Exact] {
        let record = KernelRecord::new(exact, &built[&Flavour::Fast][name]).map_err(Error::Failed)?;
        kernels.insert(name.clone(), record);
    }
    Ok(Manifest { toolchain, tools: TOOLS.map(version).into(), source_digest, kernels })
}

fn files(built: &BTreeMap<Flavour, Modules>, manifest: &Manifest) -> Result<BTreeMap<PathBuf, Vec<u8>>, Error> {
    let modules = built.iter().flat_map(|(&flavour, modules)| {
        modules.iter().map(move |(name, bytes)| (module_path(flavour, name), bytes.clone()))
    });
    let manifest = (PathBuf::from(MANIFEST), manifest.to_json()?.into_bytes());
    Ok(modules.chain([manifest]).collect())
}

/// A table of sizes, one line a kernel, with how many operations more each might have.
pub(super) fn summary(manifest: &Manifest) -> String {
    let mut text = format!("{:<24} {:>10} {:>10} {:>10} {:>10}\n", "kernel", "exact ops", "fast ops", "ratio", "room");
    for (name, record) in &manifest.kernels {
        let [exact, fast] = [record.exact.operations, record.fast.operations];
        let room = limits::MAX_OPERATIONS.saturating_sub(exact.max(fast));
        text += &format!("{name:<24} {exact:>10} {fast:>10} {:>10.2} {room:>10}\n", record.exact_per_fast);
    }
    text
}
