//! `shader build`: compile, check, and replace the committed modules.

use std::collections::BTreeMap;
use std::path::PathBuf;

use restir_kernels::KernelDesc;

use super::cargo_files::LockFile;
use super::digest::source_digest;
use super::flavour::{Entry, Flavour};
use super::manifest::{KernelRecord, Manifest};
use super::pipeline::{self, Modules};
use super::toolchain::{Identity, Toolchain};
use super::workspace::{MANIFEST, Workspace};
use super::{install, limits, publish, verify};
use crate::Error;

/// Libraries whose version the manifest records.
const TOOLS: [&str; 4] = ["naga", "rspirv", "spirv-builder", "spirv-std"];

/// The toolchain; with consent, it is installed where there is none.
pub(super) fn toolchain(workspace: &Workspace, install_toolchain: bool) -> Result<Toolchain, Error> {
    match Toolchain::find()? {
        Some(toolchain) => Ok(toolchain),
        None if install_toolchain => install::install(&workspace.kernels()),
        None => Err(Error::Environment(install::consent_message(&workspace.kernels()))),
    }
}

/// Builds all kernels.
pub(super) fn run(workspace: &Workspace, install_toolchain: bool) -> Result<(), Error> {
    let toolchain = toolchain(workspace, install_toolchain)?;
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

/// What is wrong with modules, those that are missing or too many included.
pub(super) fn findings(modules: &Modules, kernels: &[&KernelDesc]) -> Vec<String> {
    let mut findings = Vec::new();
    for (entry, bytes) in modules {
        match kernels.iter().find(|kernel| kernel.name == entry.kernel) {
            Some(kernel) => findings.extend(verify::verify(entry, bytes, kernel)),
            None => findings.push(format!("{entry}: there is a module, but no kernel of this name is listed")),
        }
    }
    let expected =
        Flavour::ALL.into_iter().flat_map(|flavour| kernels.iter().map(move |k| Entry::new(flavour, k.name)));
    let missing = expected.filter(|entry| !modules.contains_key(entry));
    findings.extend(missing.map(|entry| format!("{entry}: the kernel is listed, but there is no module for it")));
    findings
}

pub(super) fn describe(
    workspace: &Workspace,
    toolchain: Identity,
    source_digest: String,
    built: &Modules,
) -> Result<Manifest, Error> {
    let lock = LockFile::read(workspace.root())?;
    let version = |name: &str| (name.to_owned(), lock.version(name).unwrap_or("unknown").to_owned());
    let exact = built.iter().filter(|(entry, _)| entry.flavour == Flavour::Exact);
    let kernels = exact.map(|(Entry { kernel, .. }, exact)| {
        let missing = || format!("fast/{kernel}: there is no module, but one of the exact flavour");
        let fast = built.get(&Entry::new(Flavour::Fast, kernel)).ok_or_else(missing)?;
        Ok((kernel.clone(), KernelRecord::new(exact, fast)?))
    });
    let kernels = kernels.collect::<Result<_, _>>().map_err(Error::Failed)?;
    Ok(Manifest { toolchain, tools: TOOLS.map(version).into(), source_digest, kernels })
}

pub(super) fn files(built: &Modules, manifest: &Manifest) -> Result<BTreeMap<PathBuf, Vec<u8>>, Error> {
    let modules = built.iter().map(|(entry, bytes)| (entry.path(), bytes.clone()));
    Ok(modules.chain([(MANIFEST.into(), manifest.to_json()?.into_bytes())]).collect())
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
