//! Embeds the compiled kernels.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// Where `cargo xtask shader build` puts the kernels.
const SHADERS: &str = "../kernels/spirv";

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed={SHADERS}");
    embed_shaders()
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
