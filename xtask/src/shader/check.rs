//! `shader check`: whether the committed modules are what the source says, as far as this machine can tell.
//!
//! The committed files themselves are always checked: hashes, source digest, contract, limits, interfaces,
//! portability. With the toolchain of the manifest they are also rebuilt and compared byte for byte; with another
//! toolchain the entry points are compared; without one, nothing is compiled. `--require-rebuild` takes nothing less than
//! the bytes.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

use super::digest::source_digest;
use super::flavour::Flavour;
use super::manifest::{Manifest, ModuleRecord, hash};
use super::pipeline::{self, Modules};
use super::toolchain::{Identity, Toolchain};
use super::workspace::{MANIFEST, Workspace, module_path};
use super::{build, publish, tools};
use crate::Error;

/// The committed modules and what is wrong with them.
pub struct Committed {
    /// The manifest.
    pub manifest: Manifest,
    /// The modules that the manifest lists, as far as their files are there.
    pub modules: BTreeMap<Flavour, Modules>,
    /// Findings as sentences.
    pub findings: Vec<String>,
}

/// Runs the check and says how far it reached; not to have compared rebuilt bytes is a finding if `require_rebuild`.
pub(super) fn run(workspace: &Workspace, require_rebuild: bool) -> Result<(), Error> {
    let mut committed = examine(workspace)?;
    let toolchain = Toolchain::find()?;
    if toolchain.is_some() || tools::are_installed() {
        let findings = validate(&committed.modules)?;
        committed.findings.extend(findings);
    } else {
        println!("no SPIRV-Tools: the modules were not validated with spirv-val");
    }
    let scope = match toolchain {
        Some(toolchain) => {
            let identity = toolchain.identity()?;
            let built = pipeline::build(workspace, &toolchain)?;
            let (scope, findings) = compare_rebuild(&identity, &built, &committed);
            committed.findings.extend(findings);
            scope
        }
        None => Scope::Hashes,
    };
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
                f.write_str("no toolchain: hashes and source digest were compared, the bytes were not rebuilt")
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
    let modules = modules_of(&manifest, &files);
    let mut findings = compare_files(&manifest, &files);
    findings.extend(build::findings(&modules, &restir_kernels::all()));
    if source_digest(workspace)? != manifest.source_digest {
        findings.push("the source has changed since the modules were built".to_owned());
    }
    Ok(Committed { manifest, modules, findings })
}

/// Compares fresh modules with the committed ones. Gives what the comparison is worth, and its findings.
pub fn compare_rebuild(
    identity: &Identity,
    built: &BTreeMap<Flavour, Modules>,
    committed: &Committed,
) -> (Scope, Vec<String>) {
    let theirs = &committed.manifest.toolchain;
    let id = identity.id.clone();
    if identity == theirs {
        return (Scope::Bytes { id }, compare_bytes(built, &committed.modules));
    }
    let manifest = theirs.id.clone();
    (Scope::Entries { id, manifest }, compare_entries(built, &committed.modules))
}

/// Compares the files with the manifest: none missing, none more, none different.
fn compare_files(manifest: &Manifest, committed: &BTreeMap<PathBuf, Vec<u8>>) -> Vec<String> {
    let mut findings = Vec::new();
    let mut expected = vec![PathBuf::from(MANIFEST)];
    for (name, record) in &manifest.kernels {
        for flavour in Flavour::ALL {
            let path = module_path(flavour, name);
            match committed.get(&path) {
                None => findings.push(format!("{flavour}/{name}: the file is missing")),
                Some(bytes) if hash(bytes) != record.module(flavour).blake3 => {
                    findings.push(format!("{flavour}/{name}: the file is not the one in the manifest"));
                }
                Some(bytes) if ModuleRecord::new(bytes).as_ref() != Ok(record.module(flavour)) => {
                    findings.push(format!("{flavour}/{name}: the manifest does not describe the file"));
                }
                Some(_) => {}
            }
            expected.push(path);
        }
    }
    let stray = committed.keys().filter(|path| !expected.contains(path));
    findings.extend(stray.map(|path| format!("{}: the file is not in the manifest", display(path))));
    findings
}

fn display(path: &Path) -> String {
    path.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
}

fn modules_of(manifest: &Manifest, committed: &BTreeMap<PathBuf, Vec<u8>>) -> BTreeMap<Flavour, Modules> {
    let modules = |flavour| -> Modules {
        let find = |name: &String| Some((name.clone(), committed.get(&module_path(flavour, name))?.clone()));
        manifest.kernels.keys().filter_map(find).collect()
    };
    Flavour::ALL.map(|flavour| (flavour, modules(flavour))).into()
}

fn validate(modules: &BTreeMap<Flavour, Modules>) -> Result<Vec<String>, Error> {
    let mut findings = Vec::new();
    for (flavour, modules) in modules {
        for (name, bytes) in modules {
            findings.extend(tools::validate(bytes)?.map(|finding| format!("{flavour}/{name}: {finding}")));
        }
    }
    Ok(findings)
}

fn compare_bytes(built: &BTreeMap<Flavour, Modules>, committed: &BTreeMap<Flavour, Modules>) -> Vec<String> {
    let mut findings = compare_entries(built, committed);
    for (flavour, modules) in built {
        let old = committed.get(flavour);
        for (name, bytes) in modules {
            if old.and_then(|old| old.get(name)).is_some_and(|old| old != bytes) {
                findings.push(format!("{flavour}/{name}: a rebuild gives other bytes"));
            }
        }
    }
    findings
}

fn compare_entries(built: &BTreeMap<Flavour, Modules>, committed: &BTreeMap<Flavour, Modules>) -> Vec<String> {
    let entries = |modules: &BTreeMap<Flavour, Modules>| -> BTreeSet<String> {
        modules.iter().flat_map(|(f, modules)| modules.keys().map(move |name| format!("{f}/{name}"))).collect()
    };
    let (new, old) = (entries(built), entries(committed));
    let missing = new.difference(&old).map(|entry| format!("{entry}: built, but not committed"));
    let extra = old.difference(&new).map(|entry| format!("{entry}: committed, but not built any more"));
    missing.chain(extra).collect()
}
