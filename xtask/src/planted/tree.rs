//! A copy of the sources, in which lines are made wrong: the sources themselves stay as they are, also where this is interrupted.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::fault::Fault;
use crate::Error;
use crate::shader::workspace::Workspace;

/// The copy, and where it is compiled.
pub(super) struct Tree {
    root: PathBuf,
    target: PathBuf,
    commit: String,
}

impl Tree {
    /// The files that git has or would have, as they are. What is the same already stays, so that cargo does not compile it again; and
    /// what the workspace depends on is compiled once for both.
    pub(super) fn copied(workspace: &Workspace) -> Result<Self, Error> {
        let (root, target) = (workspace.target().join("planted"), workspace.target());
        let listed = git(workspace, &["ls-files", "-z", "--cached", "--others", "--exclude-standard"])?;
        for name in listed.split('\0').filter(|name| !name.is_empty()) {
            copy(&workspace.root().join(name), &root.join(name))?;
        }
        Ok(Self { root, target, commit: commit(workspace)?.0 })
    }

    /// Does something while the fault is there.
    pub(super) fn with<T>(&self, fault: &Fault, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        let path = self.root.join(&fault.file);
        let right = std::fs::read_to_string(&path).map_err(Error::io("read", &path))?;
        std::fs::write(&path, fault.planted(&right)?).map_err(Error::io("write", &path))?;
        let done = work();
        std::fs::write(&path, right).map_err(Error::io("write", &path))?;
        done
    }

    /// Cargo in the copy, with the profile of the program that runs.
    pub(super) fn cargo_test(&self) -> Command {
        let mut cargo = Command::new("cargo");
        cargo.current_dir(&self.root).args(["test", "--locked", "--quiet", "--profile", &crate::process::profile()]);
        // most of what depends on a line does not change with it
        cargo.arg("--target-dir").arg(&self.target).env("CARGO_INCREMENTAL", "1");
        cargo
    }

    /// The commit that was copied, shortened.
    pub(super) fn commit(&self) -> &str {
        &self.commit
    }
}

/// Copies a file unless it is there already; one that git knows and that is gone is left out.
fn copy(from: &Path, to: &Path) -> Result<(), Error> {
    let Ok(bytes) = std::fs::read(from) else { return Ok(()) };
    if std::fs::read(to).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    let folder = to.parent().unwrap_or(to);
    std::fs::create_dir_all(folder).map_err(Error::io("make", folder))?;
    std::fs::write(to, bytes).map_err(Error::io("write", to))
}

/// The commit, shortened, and a number that it gives.
pub(super) fn commit(workspace: &Workspace) -> Result<(String, u32), Error> {
    let hash = git(workspace, &["rev-parse", "HEAD"])?;
    let short = hash.get(..8).unwrap_or_default().to_owned();
    let number = u32::from_str_radix(&short, 16);
    number.map(|number| (short, number)).map_err(|_| Error::Environment(format!("git names no commit: {hash:?}")))
}

fn git(workspace: &Workspace, arguments: &[&str]) -> Result<String, Error> {
    let output = Command::new("git").args(arguments).current_dir(workspace.root()).output();
    let output = output.map_err(|error| Error::Environment(format!("cannot run git: {error}; install it")))?;
    if !output.status.success() {
        let problem = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        return Err(Error::Environment(format!("`git {}` fails: {problem}", arguments.join(" "))));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
