//! Records the commit that is built, for the metadata of images: `RESTIR_COMMIT` is its hash, with `-dirty` if files
//! differ from it, or `unknown` outside the project's repository.

use std::path::Path;
use std::process::Command;

/// What is compiled into the program; a change may change whether the tree is dirty.
const SOURCES: [&str; 7] =
    ["src", "Cargo.toml", "../src", "../Cargo.toml", "../../shared/src", "../../kernels/src", "../../kernels/spirv"];

fn main() {
    println!("cargo::rustc-env=RESTIR_COMMIT={}", commit().unwrap_or_else(|| "unknown".to_owned()));
    let references =
        ["HEAD", "refs/heads", "packed-refs"].into_iter().filter_map(|name| git(&["rev-parse", "--git-path", name]));
    let paths = references.chain(SOURCES.map(str::to_owned)).filter(|path| Path::new(path).exists());
    println!("cargo::rerun-if-changed=build.rs");
    // in a build for development only the first tier of the tests runs
    if std::env::var("PROFILE").is_ok_and(|profile| profile == "debug") {
        println!("cargo::rustc-cfg=first_tier");
    }
    paths.for_each(|path| println!("cargo::rerun-if-changed={path}"));
}

fn commit() -> Option<String> {
    // A packaged copy may lie inside a repository that is not this project's.
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    let hash = git(&["rev-parse", "HEAD"])?;
    let changes = git(&["--no-optional-locks", "status", "--porcelain"])?;
    Some(if changes.is_empty() { hash } else { format!("{hash}-dirty") })
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
