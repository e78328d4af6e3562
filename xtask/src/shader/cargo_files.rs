//! What Cargo's files say about the crates that are compiled for the device.

use std::collections::BTreeSet;
use std::path::Path;

use serde::Deserialize;
use toml::{Table, Value};

use crate::Error;

/// The parts of `Cargo.lock` that matter here.
#[derive(Debug, Default, Deserialize)]
pub struct LockFile {
    #[serde(default)]
    package: Vec<Package>,
}

#[derive(Debug, Deserialize)]
struct Package {
    name: String,
    version: String,
    checksum: Option<String>,
    #[serde(default)]
    dependencies: Vec<String>,
}

impl LockFile {
    /// Reads the lock file in the root of a workspace.
    pub fn read(root: &Path) -> Result<Self, Error> {
        read_toml(&root.join("Cargo.lock"))
    }

    /// Version of a package.
    pub fn version(&self, name: &str) -> Option<&str> {
        self.package.iter().find(|p| p.name == name).map(|p| p.version.as_str())
    }

    /// The external crates that the given members of the workspace reach, one sorted line each.
    ///
    /// The lock file lists a member's development dependencies too, so the members' manifests are the start.
    pub fn device_crates(&self, root: &Path, members: &[&str]) -> Result<BTreeSet<String>, Error> {
        Ok(self.closure(dependencies(root, members)?))
    }

    fn closure(&self, mut pending: Vec<String>) -> BTreeSet<String> {
        let mut lines = BTreeSet::new();
        while let Some(dependency) = pending.pop() {
            // Without a checksum a package is a member, and its source is hashed itself.
            for package in self.resolve(&dependency).filter(|p| p.checksum.is_some()) {
                let checksum = package.checksum.as_deref().unwrap_or_default();
                if lines.insert(format!("{} {} {checksum}", package.name, package.version)) {
                    pending.extend(package.dependencies.iter().cloned());
                }
            }
        }
        lines
    }

    /// The lock file names a dependency alone, or with its version where there are several.
    fn resolve<'a>(&'a self, dependency: &'a str) -> impl Iterator<Item = &'a Package> {
        let mut words = dependency.split(' ');
        let (name, version) = (words.next(), words.next());
        self.package.iter().filter(move |p| Some(p.name.as_str()) == name && version.is_none_or(|v| v == p.version))
    }
}

/// What the workspace's manifest sets for the given members, one sorted line each: features of their dependencies,
/// and the profiles.
pub fn workspace_settings(root: &Path, members: &[&str]) -> Result<BTreeSet<String>, Error> {
    let manifest: Table = read_toml(&root.join("Cargo.toml"))?;
    let none = Table::new().into();
    let mut lines = BTreeSet::from([format!("profile {}", json(manifest.get("profile").unwrap_or(&none)))]);
    let settings = manifest.get("workspace").and_then(|workspace| workspace.get("dependencies")).unwrap_or(&none);
    let names = dependencies(root, members)?;
    lines.extend(names.iter().filter_map(|name| Some(format!("{name} {}", json(settings.get(name)?)))));
    Ok(lines)
}

/// Names of what the members depend on in a build.
fn dependencies(root: &Path, members: &[&str]) -> Result<Vec<String>, Error> {
    let mut names = Vec::new();
    for member in members {
        let manifest: Table = read_toml(&root.join(member).join("Cargo.toml"))?;
        let table = manifest.get("dependencies").and_then(Value::as_table);
        names.extend(table.into_iter().flat_map(Table::keys).cloned());
    }
    Ok(names)
}

/// A text that is equal for equal values: tables are sorted by key.
fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

fn read_toml<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, Error> {
    let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
    toml::from_str(&text).map_err(|e| Error::Environment(format!("{} is not valid: {e}", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closure_follows_versions_and_skips_members() {
        let lock: LockFile = toml::from_str(
            r#"
            package = [
                { name = "member", version = "0.1.0", dependencies = ["glam"] },
                { name = "spirv-std", version = "0.10.0", checksum = "a", dependencies = ["glam 0.33.12"] },
                { name = "glam", version = "0.33.12", checksum = "b" },
                { name = "glam", version = "0.34.2", checksum = "c" },
                { name = "wgpu", version = "30.0.0", checksum = "d" },
            ]
            "#,
        )
        .unwrap();
        let lines = lock.closure(vec!["member".to_owned(), "spirv-std".to_owned()]);
        assert_eq!(lines.into_iter().collect::<Vec<_>>(), ["glam 0.33.12 b", "spirv-std 0.10.0 a"]);
        assert_eq!(lock.version("wgpu"), Some("30.0.0"));
    }
}
