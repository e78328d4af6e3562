//! `shader check`: whether the committed modules are what the source says, as far as this machine can tell.
//!
//! The committed files themselves are always checked: hashes, source digest, contract, limits, interfaces,
//! portability. With the toolchain of the manifest they are also rebuilt and compared byte for byte; with another
//! toolchain the entry points are compared; without one, nothing is compiled. `--require-rebuild` takes nothing less than
//! the bytes.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use super::digest::{portable_name, source_digest};
use super::flavour::{Entry, Flavour};
use super::manifest::{Manifest, ModuleRecord, hash};
use super::pipeline::{self, Modules};
use super::toolchain::{Identity, Toolchain};
use super::workspace::{MANIFEST, Workspace};
use super::{build, publish, tools};
use crate::Error;

/// The committed modules and what is wrong with them.
pub struct Committed {
    /// The manifest.
    pub manifest: Manifest,
    /// The modules that the manifest lists, as far as their files are there.
    pub modules: Modules,
    /// Findings as sentences.
    pub findings: Vec<String>,
}

/// Runs the check and says how far it reached; not to have compared rebuilt bytes is a finding if `require_rebuild`.
pub(super) fn run(workspace: &Workspace, require_rebuild: bool) -> Result<(), Error> {
    let mut committed = examine(workspace)?;
    let toolchain = Toolchain::find()?;
    if toolchain.is_some() || tools::are_installed() {
        for (entry, bytes) in &committed.modules {
            committed.findings.extend(tools::validate(bytes)?.map(|finding| format!("{entry}: {finding}")));
        }
    } else {
        println!("no SPIRV-Tools: the modules were not validated with spirv-val");
    }
    let mut scope = Scope::Hashes;
    if let Some(toolchain) = toolchain {
        let identity = toolchain.identity()?;
        let built = pipeline::build(workspace, &toolchain)?;
        let findings;
        (scope, findings) = compare_rebuild(&identity, &built, &committed);
        committed.findings.extend(findings);
    }
    print!("{}", build::summary(&committed.manifest));
    println!("{scope}");
    let reached = require(&scope, require_rebuild);
    judge(&committed)?;
    reached
}

/// How far a check reached.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Scope {
    /// There is no toolchain: nothing was rebuilt.
    Hashes,
    /// The bytes of a rebuild were compared.
    Bytes {
        /// The toolchain's identity, that of the manifest.
        id: String,
    },
    /// The entry points of a rebuild were compared.
    Entries {
        /// The toolchain's identity.
        id: String,
        /// That of the manifest.
        manifest: String,
    },
}

impl fmt::Display for Scope {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hashes => {
                write!(f, "no toolchain: hashes and source digest were compared, the bytes were not rebuilt")
            }
            Self::Bytes { id } => write!(f, "toolchain {id}, that of the manifest: rebuilt and compared byte for byte"),
            Self::Entries { id, manifest } => write!(
                f,
                "toolchain {id} is not {manifest}, that of the manifest: rebuilt, and the entry points were compared, \
                 not the bytes"
            ),
        }
    }
}

/// Whether the check reached as far as it has to.
///
/// # Errors
/// [`Error::Failed`] if a rebuild is required and its bytes were not compared.
pub fn require(scope: &Scope, rebuild: bool) -> Result<(), Error> {
    if !rebuild || matches!(scope, Scope::Bytes { .. }) {
        return Ok(());
    }
    Err(Error::Failed(format!(
        "--require-rebuild: {scope}; install the toolchain of the manifest, or build with this one and commit \
         kernels/spirv"
    )))
}

fn judge(committed: &Committed) -> Result<(), Error> {
    if committed.findings.is_empty() {
        println!("{} kernels: the committed modules are in order", committed.manifest.kernels.len());
        return Ok(());
    }
    Err(Error::Failed(format!(
        "the committed modules are not in order:\n  {}\nRun `cargo xtask shader build` and commit kernels/spirv.",
        committed.findings.join("\n  ")
    )))
}

/// Everything that needs neither a toolchain nor SPIRV-Tools.
pub fn examine(workspace: &Workspace) -> Result<Committed, Error> {
    let manifest = Manifest::read(&workspace.spirv())?;
    let files = publish::read_files(&workspace.spirv())?;
    let module = |entry: Entry| files.get(&entry.path()).map(|bytes| (entry, bytes.clone()));
    let modules = entries(&manifest).filter_map(module).collect();
    let mut findings = compare_files(&manifest, &files);
    findings.extend(build::findings(&modules, &restir_kernels::all()));
    if source_digest(workspace)? != manifest.source_digest {
        findings.push("the source has changed since the modules were built".to_owned());
    }
    Ok(Committed { manifest, modules, findings })
}

/// Compares fresh modules with the committed ones. Gives what the comparison is worth, and its findings.
pub fn compare_rebuild(identity: &Identity, built: &Modules, committed: &Committed) -> (Scope, Vec<String>) {
    let (old, manifest) = (&committed.modules, &committed.manifest.toolchain);
    let missing = built.keys().filter(|entry| !old.contains_key(entry));
    let extra = old.keys().filter(|entry| !built.contains_key(entry));
    let mut findings: Vec<String> = missing.map(|entry| format!("{entry}: built, but not committed")).collect();
    findings.extend(extra.map(|entry| format!("{entry}: committed, but not built any more")));
    let id = identity.id.clone();
    if identity != manifest {
        return (Scope::Entries { id, manifest: manifest.id.clone() }, findings);
    }
    let different = built.iter().filter(|(entry, bytes)| old.get(entry).is_some_and(|old| old != *bytes));
    findings.extend(different.map(|(entry, _)| format!("{entry}: a rebuild gives other bytes")));
    (Scope::Bytes { id }, findings)
}

/// Compares the files with the manifest: none missing, none more, none different.
fn compare_files(manifest: &Manifest, committed: &BTreeMap<PathBuf, Vec<u8>>) -> Vec<String> {
    let mut findings = Vec::new();
    let mut expected = vec![PathBuf::from(MANIFEST)];
    for entry in entries(manifest) {
        let record = manifest.kernels[&entry.kernel].module(entry.flavour);
        match committed.get(&entry.path()) {
            None => findings.push(format!("{entry}: the file is missing")),
            Some(bytes) if hash(bytes) != record.blake3 => {
                findings.push(format!("{entry}: the file is not the one in the manifest"));
            }
            Some(bytes) if ModuleRecord::new(bytes).as_ref() != Ok(record) => {
                findings.push(format!("{entry}: the manifest does not describe the file"));
            }
            Some(_) => {}
        }
        expected.push(entry.path());
    }
    let stray = committed.keys().filter(|path| !expected.contains(path));
    findings.extend(stray.map(|path| format!("{}: the file is not in the manifest", portable_name(path))));
    findings
}

/// What the manifest lists.
fn entries(manifest: &Manifest) -> impl Iterator<Item = Entry> {
    manifest.kernels.keys().flat_map(|name| Flavour::ALL.map(|flavour| Entry::new(flavour, name)))
}
