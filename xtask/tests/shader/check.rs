//! `shader check` on copies of the repository in which something is wrong.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use xtask::Error;
use xtask::shader::check::{Scope, compare_rebuild, examine, require};
use xtask::shader::digest::source_digest;
use xtask::shader::manifest::Manifest;
use xtask::shader::workspace::{MANIFEST, Workspace};
use xtask::shader::{Entry, Flavour};

/// What `check` looks at, copied, with the digest of the source as it is now.
struct Copy {
    folder: TempDir,
}

impl Copy {
    fn new() -> Self {
        let copy = Self { folder: tempfile::tempdir().unwrap() };
        let root = Workspace::current().root().to_owned();
        for path in ["Cargo.toml", "Cargo.lock", "shared", "kernels", "spirv-exact", "xtask/src/shader"] {
            copy_tree(&root.join(path), &copy.folder.path().join(path));
        }
        copy.edit_manifest(|manifest| manifest.source_digest = source_digest(&copy.workspace()).unwrap());
        copy
    }

    fn workspace(&self) -> Workspace {
        Workspace::new(self.folder.path())
    }

    fn edit_manifest(&self, edit: impl FnOnce(&mut Manifest)) {
        let spirv = self.workspace().spirv();
        let mut manifest = Manifest::read(&spirv).unwrap();
        edit(&mut manifest);
        fs::write(spirv.join(MANIFEST), manifest.to_json().unwrap()).unwrap();
    }

    fn module(&self, flavour: Flavour, kernel: &str) -> PathBuf {
        self.workspace().spirv().join(Entry::new(flavour, kernel).path())
    }

    fn findings(&self) -> Vec<String> {
        examine(&self.workspace()).unwrap().findings
    }
}

fn copy_tree(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).unwrap();
        for entry in fs::read_dir(from).unwrap() {
            let name = entry.unwrap().file_name();
            copy_tree(&from.join(&name), &to.join(&name));
        }
    } else {
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(from, to).unwrap();
    }
}

#[test]
fn a_faithful_copy_is_in_order() {
    assert_eq!(Copy::new().findings(), Vec::<String>::new());
}

#[test]
fn changed_source_is_noticed() {
    let copy = Copy::new();
    let source = copy.workspace().kernels().join("src/lib.rs");
    fs::write(&source, fs::read_to_string(&source).unwrap() + "\n// changed\n").unwrap();
    assert_eq!(copy.findings(), ["the source has changed since the modules were built"]);
}

#[test]
fn changed_missing_and_stray_files_are_named() {
    let copy = Copy::new();
    let exact = copy.module(Flavour::Exact, "self_check");
    fs::remove_file(copy.module(Flavour::Fast, "self_check")).unwrap();
    fs::copy(&exact, copy.module(Flavour::Exact, "stray")).unwrap();
    // The generator's number, which changes no meaning.
    let mut bytes = fs::read(&exact).unwrap();
    bytes[8] ^= 1;
    fs::write(&exact, bytes).unwrap();
    assert_eq!(
        copy.findings(),
        [
            "exact/self_check: the file is not the one in the manifest",
            "fast/self_check: the file is missing",
            "exact/stray.spv: the file is not in the manifest",
            "fast/self_check: the kernel is listed, but there is no module for it",
        ]
    );
}

#[test]
fn a_module_without_a_kernel_is_named() {
    let copy = Copy::new();
    for flavour in Flavour::ALL {
        fs::copy(copy.module(flavour, "self_check"), copy.module(flavour, "smuggled")).unwrap();
    }
    copy.edit_manifest(|manifest| {
        let record = manifest.kernels["self_check"].clone();
        manifest.kernels.insert("smuggled".to_owned(), record);
    });
    let expected =
        Flavour::ALL.map(|f| format!("{f}/smuggled: there is a module, but no kernel of this name is listed"));
    assert_eq!(copy.findings(), expected);
}

#[test]
fn a_manifest_that_misdescribes_a_file_is_noticed() {
    let copy = Copy::new();
    copy.edit_manifest(|manifest| manifest.kernels.get_mut("self_check").unwrap().exact.operations += 1);
    assert_eq!(copy.findings(), ["exact/self_check: the manifest does not describe the file"]);
}

#[test]
fn a_damaged_manifest_is_an_error_with_advice() {
    let copy = Copy::new();
    fs::write(copy.workspace().spirv().join(MANIFEST), "{").unwrap();
    let error = examine(&copy.workspace()).err().unwrap().to_string();
    assert!(error.contains("is damaged") && error.contains("cargo xtask shader build"), "{error}");
}

#[test]
fn the_toolchain_of_the_manifest_must_give_the_same_bytes() {
    let committed = examine(&Copy::new().workspace()).unwrap();
    let identity = committed.manifest.toolchain.clone();
    let mut built = committed.modules.clone();
    let (scope, findings) = compare_rebuild(&identity, &built, &committed);
    assert!(scope.to_string().contains("byte for byte"), "{scope}");
    assert!(require(&scope, true).is_ok());
    assert_eq!(findings, Vec::<String>::new());
    built.get_mut(&Entry::new(Flavour::Fast, "self_check")).unwrap().push(0);
    let (_, findings) = compare_rebuild(&identity, &built, &committed);
    assert_eq!(findings, ["fast/self_check: a rebuild gives other bytes"]);
}

#[test]
fn another_toolchain_must_give_the_same_entry_points() {
    let committed = examine(&Copy::new().workspace()).unwrap();
    let mut identity = committed.manifest.toolchain.clone();
    identity.id = "another".to_owned();
    let mut built = committed.modules.clone();
    let module = built.remove(&Entry::new(Flavour::Exact, "self_check")).unwrap();
    built.insert(Entry::new(Flavour::Exact, "renamed"), module);
    built.get_mut(&Entry::new(Flavour::Fast, "self_check")).unwrap().push(0);
    let (scope, findings) = compare_rebuild(&identity, &built, &committed);
    let text = scope.to_string();
    assert!(text.starts_with("toolchain another is not") && text.contains("not the bytes"), "{text}");
    assert!(require(&scope, false).is_ok());
    assert!(matches!(require(&scope, true), Err(Error::Failed(_))));
    assert_eq!(
        findings,
        ["exact/renamed: built, but not committed", "exact/self_check: committed, but not built any more",]
    );
}

#[test]
fn a_required_rebuild_without_a_toolchain_fails() {
    assert!(require(&Scope::Hashes, false).is_ok());
    let error = require(&Scope::Hashes, true).unwrap_err();
    assert!(matches!(error, Error::Failed(_)));
    assert!(error.to_string().contains("no toolchain"), "{error}");
}
