//! Embeds the compiled kernels, and records the commit that is built, for the metadata of images: `RESTIR_COMMIT` is
//! its hash, with `-dirty` if files differ from it, or `unknown` outside the project's repository.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

/// Where `cargo xtask shader build` puts the kernels.
const SHADERS: &str = "../kernels/spirv";

/// What is compiled into the program; a change may change whether the tree is dirty.
const SOURCES: [&str; 5] = ["src", "Cargo.toml", "../shared/src", "../kernels/src", "../kernels/spirv"];

fn main() -> io::Result<()> {
    embed_shaders()?;
    println!("cargo::rustc-env=RESTIR_COMMIT={}", commit().unwrap_or_else(|| "unknown".to_owned()));
    let references =
        ["HEAD", "refs/heads", "packed-refs"].into_iter().filter_map(|name| git(&["rev-parse", "--git-path", name]));
    let paths = references.chain(SOURCES.map(str::to_owned)).filter(|path| Path::new(path).exists());
    println!("cargo::rerun-if-changed=build.rs");
    paths.for_each(|path| println!("cargo::rerun-if-changed={path}"));
    Ok(())
}

/// Writes a table of (name, bytes) of all files in [`SHADERS`].
fn embed_shaders() -> io::Result<()> {
    let mut rows = String::new();
    for folder in ["", "exact/", "fast/"] {
        let Ok(entries) = fs::read_dir(Path::new(SHADERS).join(folder)) else {
            continue;
        };
        let mut files: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(|p| p.is_file()).collect();
        files.sort();
        for file in files {
            let name = format!("{folder}{}", file.file_name().unwrap_or_default().to_string_lossy());
            rows += &format!("({name:?}, include_bytes!({:?}) as &[u8]),\n", file.canonicalize()?);
        }
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default());
    fs::write(out.join("shaders.rs"), format!("&[\n{rows}]"))
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
