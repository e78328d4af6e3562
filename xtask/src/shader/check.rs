//! `shader check`: whether the committed modules are what the source says, as far as this machine can tell.
//!
//! The committed files themselves are always checked: hashes, source digest, contract, limits, interfaces,
//! portability. With the toolchain of the manifest they are also rebuilt and compared byte for byte; with another
//! toolchain the entry points are compared; without one, nothing is compiled.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use restir_kernels::KernelDesc;

use super::digest::source_digest;
use super::flavour::Flavour;
use super::manifest::{Manifest, ModuleRecord, hash};
use super::pipeline::{self, Modules};
use super::toolchain::Toolchain;
use super::workspace::{MANIFEST, Workspace, module_path};
use super::{build, publish, tools};
use crate::Error;

/// Runs the check and says how far it reached.
pub(super) fn run(workspace: &Workspace) -> Result<(), Error> {
    let manifest = Manifest::read(&workspace.spirv())?;
    let committed = publish::read_files(&workspace.spirv())?;
    let mut findings = compare_files(&manifest, &committed);
    let modules = modules_of(&manifest, &committed);
    findings.extend(build::findings(&modules, restir_kernels::ALL));
    let toolchain = Toolchain::find()?;
    if toolchain.is_some() || tools::are_installed() {
        findings.extend(validate(&modules)?);
    } else {
        println!("no SPIRV-Tools: the modules were not validated with spirv-val");
    }
    if source_digest(workspace)? != manifest.source_digest {
        findings.push("the source has changed since the modules were built".to_owned());
    }
    let scope = match toolchain {
        Some(toolchain) => rebuild(workspace, &toolchain, &manifest, &modules, &mut findings)?,
        None => "no toolchain: hashes and source digest were compared, the bytes were not rebuilt".to_owned(),
    };
    println!("{scope}");
    if findings.is_empty() {
        println!("{} kernels: the committed modules are in order", manifest.kernels.len());
        return Ok(());
    }
    Err(Error::Failed(format!(
        "the committed modules are not in order:\n  {}\nRun `cargo xtask shader build` and commit kernels/spirv.",
        findings.join("\n  ")
    )))
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
    path.iter()
        .map(|part| part.to_string_lossy())
        .collect::<Vec<_>>()
        .join("/")
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

/// Rebuilds with the toolchain at hand and says what the comparison is worth.
fn rebuild(
    workspace: &Workspace,
    toolchain: &Toolchain,
    manifest: &Manifest,
    committed: &BTreeMap<Flavour, Modules>,
    findings: &mut Vec<String>,
) -> Result<String, Error> {
    let identity = toolchain.identity()?;
    let built = pipeline::build(workspace, toolchain)?;
    if identity == manifest.toolchain {
        findings.extend(compare_bytes(&built, committed));
        return Ok(format!(
            "toolchain {}, that of the manifest: rebuilt and compared byte for byte",
            identity.id
        ));
    }
    findings.extend(compare_built_entries(&built, restir_kernels::ALL));
    Ok(format!(
        "toolchain {} is not {}, that of the manifest: rebuilt, and the entry points were compared, not the bytes",
        identity.id, manifest.toolchain.id
    ))
}

fn compare_bytes(built: &BTreeMap<Flavour, Modules>, committed: &BTreeMap<Flavour, Modules>) -> Vec<String> {
    let mut findings = Vec::new();
    for (flavour, modules) in built {
        for (name, bytes) in modules {
            match committed[flavour].get(name) {
                None => findings.push(format!("{flavour}/{name}: built, but not committed")),
                Some(old) if old != bytes => findings.push(format!("{flavour}/{name}: a rebuild gives other bytes")),
                Some(_) => {}
            }
        }
    }
    findings
}

fn compare_built_entries(built: &BTreeMap<Flavour, Modules>, kernels: &[KernelDesc]) -> Vec<String> {
    let compare = |(&flavour, modules): (&Flavour, &Modules)| {
        super::verify::compare_entries(modules.keys().map(String::as_str), flavour, kernels)
    };
    built.iter().flat_map(compare).collect()
}
