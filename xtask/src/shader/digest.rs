//! The source digest: equal digests mean that the committed modules were made from this source.
//!
//! It covers the source of both device crates with their manifests, the steps of this tool that shape the bytes, what
//! the workspace sets for these crates, and the locked version of each crate that is compiled for the device. It does not depend on where the repository lies
//! or on how its lines end.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::cargo_files::{LockFile, workspace_settings};
use super::publish::read_files;
use super::workspace::Workspace;
use crate::Error;

/// The crates whose whole source is compiled for the device.
const CRATES: [&str; 2] = ["shared", "kernels"];
/// Steps of the build that decide bytes.
const STEPS: [&str; 8] = [
    "spirv-exact/src/canonical.rs",
    "spirv-exact/src/module.rs",
    "spirv-exact/src/post.rs",
    "xtask/src/shader/compile.rs",
    "xtask/src/shader/inserts.rs",
    "xtask/src/shader/loops.rs",
    "xtask/src/shader/pipeline.rs",
    "xtask/src/shader/tools.rs",
];

/// Digest of everything in the repository that decides the bytes of the modules.
pub fn source_digest(workspace: &Workspace) -> Result<String, Error> {
    let root = workspace.root();
    let mut hasher = blake3::Hasher::new();
    for (file, text) in source_files(root)? {
        entry(&mut hasher, &portable_name(&file), &unix_lines(&text));
    }
    for line in workspace_settings(root, &CRATES)? {
        entry(&mut hasher, "Cargo.toml", line.as_bytes());
    }
    for line in LockFile::read(root)?.device_crates(root, &CRATES)? {
        entry(&mut hasher, "Cargo.lock", line.as_bytes());
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// Length-prefixed, so that no two lists of entries look alike.
pub(super) fn entry(hasher: &mut blake3::Hasher, name: &str, contents: &[u8]) {
    for part in [name.as_bytes(), contents] {
        hasher.update(&(part.len() as u64).to_le_bytes());
        hasher.update(part);
    }
}

fn source_files(root: &Path) -> Result<BTreeMap<PathBuf, Vec<u8>>, Error> {
    let mut files = BTreeMap::new();
    for name in CRATES {
        let folder = Path::new(name).join("src");
        let sources =
            read_files(&root.join(&folder))?.into_iter().filter(|(file, _)| file.extension() == Some("rs".as_ref()));
        files.extend(sources.map(|(file, text)| (folder.join(file), text)));
    }
    let manifests = CRATES.map(|name| Path::new(name).join("Cargo.toml"));
    for file in manifests.into_iter().chain(STEPS.map(PathBuf::from)) {
        let path = root.join(&file);
        files.insert(file, std::fs::read(&path).map_err(Error::io("read", &path))?);
    }
    Ok(files)
}

/// A path with slashes on every system.
pub fn portable_name(path: &Path) -> String {
    path.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
}

fn unix_lines(text: &[u8]) -> Vec<u8> {
    let carriage_return = |i: usize| text[i] == b'\r' && text.get(i + 1) == Some(&b'\n');
    (0..text.len()).filter(|&i| !carriage_return(i)).map(|i| text[i]).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn line_ends_do_not_count() {
        assert_eq!(unix_lines(b"a\r\nb\rc\n\r\n"), b"a\nb\rc\n\n");
    }

    #[test]
    fn every_source_file_counts() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let write = |path: &str, text: &str| {
            let path = root.join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        for name in CRATES {
            write(&format!("{name}/Cargo.toml"), &format!("[package]\nname = \"{name}\"\n"));
            write(&format!("{name}/src/lib.rs"), "");
        }
        for step in STEPS {
            write(step, "");
        }
        write("Cargo.lock", "");
        write("Cargo.toml", "");
        let workspace = Workspace::new(root);
        let mut seen = BTreeSet::from([source_digest(&workspace).unwrap()]);
        let feature = "[workspace.dependencies]\nglam = { version = \"0.33\", features = [\"libm\"] }\n";
        let locked = "[[package]]\nname = \"glam\"\nversion = \"0.33.12\"\nchecksum = \"a\"\n";
        for (path, text, counts) in [
            ("shared/src/lib.rs", "changed", true),
            ("kernels/src/deep/er.rs", "new", true),
            ("kernels/Cargo.toml", "[package]\nname = \"changed\"\n", true),
            ("spirv-exact/src/post.rs", "changed", true),
            ("host/src/lib.rs", "unrelated", false),
            ("shared/Cargo.toml", "[dependencies]\nglam.workspace = true\n", true),
            ("Cargo.toml", feature, true),
            ("Cargo.lock", locked, true),
        ] {
            write(path, text);
            assert_eq!(seen.insert(source_digest(&workspace).unwrap()), counts, "{path}: {text}");
        }
    }
}
