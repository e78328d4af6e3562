//! `cargo lab features --compiled-out`: the kernel `path`, built from source in which the code of a feature is compiled out, beside
//! the shipped module where it is frozen to scenes without the feature.
//!
//! The source is a copy below the target directory, so that no line of what is shipped knows of this. In the copy a feature has no bit
//! and the tests for it are `false`, with which the compiler drops what they guard; `path` is its only kernel.

use std::collections::BTreeMap;
use std::path::Path;

use restir_host::exec::Flavour;
use restir_kernels::path::path;
use restir_shared::layout::{FEATURE_CLEAR_BORDER, FEATURE_SUBSURFACE, FEATURES_ALL, FEATURES_DIFFUSE};
use restir_tests::features::{Content, PARTS, specialised, specialised_of};
use restir_tests::fingerprint;

use crate::Error;
use crate::report::publish;
use xtask::shader::compile::Job;
use xtask::shader::module::{operation_name, operations, parse};
use xtask::shader::pipeline::finish_module;
use xtask::shader::publish::{read_files, write};
use xtask::shader::toolchain::Toolchain;
use xtask::shader::workspace::{Workspace, scratch};
use xtask::shader::{self, Entry, install};

/// What the kernel `path` can be asked for: scenes with light under their surfaces have kernels of their own.
pub(crate) const ALL: u32 = FEATURES_ALL & !(FEATURE_SUBSURFACE | FEATURE_CLEAR_BORDER);
/// Members of the workspace, without which its lock file would not fit.
const MEMBERS: [&str; 10] =
    ["shared", "kernels", "host", "restir", "tests", "lab", "xtask", "python", "spirv-exact", "examples"];
/// Members whose code runs on the device.
const DEVICE: [&str; 2] = ["shared/src", "kernels/src"];

/// Builds the kernel without each feature of these names, or of all names where there are none; prints the table, or writes the report.
///
/// # Errors
/// [`Error::Environment`] without the shader toolchain or SPIRV-Tools.
pub(crate) fn run(names: &[String], is_written: bool) -> Result<(), Error> {
    known(names)?;
    let original = Workspace::current();
    let toolchain =
        Toolchain::find()?.ok_or_else(|| Error::Environment(install::consent_message(&original.kernels())))?;
    let copy = Workspace::copy(original.target().join("compiled-out"));
    for member in MEMBERS {
        copy_sources(original.root(), copy.root(), member, &|_, text| text)?;
    }
    for file in ["Cargo.toml", "Cargo.lock"] {
        update(&copy.root().join(file), &read(&original.root().join(file))?)?;
    }
    let wanted = |name: &str| names.is_empty() || names.iter().any(|asked| asked == name);
    let mut rows = String::new();
    for (name, feature) in parts().filter(|(name, _)| wanted(name)) {
        for folder in DEVICE {
            copy_sources(original.root(), copy.root(), folder, &|file, text| without(file, &text, &constant(name)))?;
        }
        let words = build(&copy, &toolchain)?;
        rows += &row(name, ALL & !feature, &words)?;
        rows += &row(&format!("{name}, diffuse"), FEATURES_DIFFUSE & !feature, &words)?;
    }
    publish("compiled-out", &report(&rows), is_written)
}

/// Features by name: those of `path`, and light inside of bodies, which has kernels of its own.
fn parts() -> impl Iterator<Item = (&'static str, u32)> {
    PARTS.iter().map(|part| (part.name, part.feature)).chain([("subsurface", FEATURE_SUBSURFACE)])
}

/// An error that lists the features if one of the names is none.
pub(crate) fn known(names: &[String]) -> Result<(), Error> {
    let unknown = |name: &&String| !parts().any(|(known, _)| known == **name);
    let Some(name) = names.iter().find(unknown) else { return Ok(()) };
    let names: Vec<&str> = parts().map(|(name, _)| name).collect();
    Err(Error::Environment(format!("no feature is called {name}; there are: {}", names.join(", "))))
}

fn constant(name: &str) -> String {
    format!("FEATURE_{}", name.to_uppercase().replace(' ', "_"))
}

/// Brings the sources and manifests below a folder of the copy up to date; `edit` has a file's name and its text.
fn copy_sources(from: &Path, to: &Path, folder: &str, edit: &dyn Fn(&str, String) -> String) -> Result<(), Error> {
    for (file, bytes) in read_files(&from.join(folder))? {
        if file.extension().is_some_and(|extension| extension == "rs" || extension == "toml") {
            let text = String::from_utf8_lossy(&bytes).into_owned();
            let name = Path::new(folder).join(file);
            let text = edit(&shader::digest::portable_name(&name), text);
            update(&to.join(&name), &text)?;
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<String, Error> {
    std::fs::read_to_string(path).map_err(Error::io("read", path))
}

/// Writes a file unless it has this text: cargo builds again what was written.
fn update(path: &Path, text: &str) -> Result<(), Error> {
    let is_new = std::fs::read_to_string(path).is_ok_and(|old| old == text);
    if is_new { Ok(()) } else { Ok(write(path, text.as_bytes())?) }
}

/// A file of the device's without the code of a feature.
fn without(file: &str, text: &str, constant: &str) -> String {
    match file {
        "kernels/src/lib.rs" => only(text, "folders!"),
        "kernels/src/path/mod.rs" => only(text, "kernels!"),
        _ => compiled_out(text, constant),
    }
}

/// The list of a macro with `path` alone.
fn only(text: &str, list: &str) -> String {
    let Some((before, rest)) = text.split_once(&format!("\n{list} {{")) else { return text.to_owned() };
    let after = rest.split_once('}').map_or("", |(_, after)| after);
    format!("{before}\n{list} {{ path }}{after}")
}

/// The text in which the constant is 0, and what tests for it a truth.
fn compiled_out(text: &str, constant: &str) -> String {
    let declaration = format!("pub const {constant}: u32 =");
    let declared =
        |line: &str| if line.starts_with(&declaration) { format!("{declaration} 0;") } else { line.to_owned() };
    let text = text.lines().map(declared).collect::<Vec<_>>().join("\n") + "\n";
    let asked = format!("has({constant})");
    let text = text.replace(&format!("self.{asked}"), "false").replace(&asked, "false");
    let text = replace_test(&text, &format!(" & {constant} != 0"), "false");
    replace_test(&text, &format!(" & {constant} == 0"), "true")
}

/// Puts a truth in place of each comparison that ends so, with the operand before it.
fn replace_test(text: &str, end: &str, truth: &str) -> String {
    let mut pieces: Vec<&str> = text.split(end).collect();
    let last = pieces.pop().unwrap_or_default();
    pieces.into_iter().map(|piece| piece[..operand(piece)].to_owned() + truth).collect::<String>() + last
}

/// Where the operand begins that ends the text: names, with dots between them and perhaps empty parentheses at the end.
fn operand(text: &str) -> usize {
    let names = text.strip_suffix("()").unwrap_or(text);
    names.trim_end_matches(|c: char| c.is_alphanumeric() || c == '_' || c == '.').len()
}

/// The kernel of a copy, as it would be shipped.
fn build(copy: &Workspace, toolchain: &Toolchain) -> Result<Vec<u32>, Error> {
    let folder = scratch()?;
    let job = Job::new(copy, toolchain, shader::Flavour::Exact, &[], folder.path().join("modules"));
    let raw = job.start()?.finish()?.into_values().next();
    let raw = raw.ok_or_else(|| Error::Failed("the copy of the source has no kernel".to_owned()))?;
    let module = finish_module(&Entry::new(shader::Flavour::Exact, path::DESC.name), &raw)?;
    Ok(bytemuck::pod_collect_to_vec(&module))
}

/// The shipped module and the other one, both specialised to the features.
fn row(name: &str, features: u32, other: &[u32]) -> Result<String, Error> {
    let row = || {
        let modules = [specialised(Flavour::Exact, features)?, specialised_of(other, features)?];
        let [shipped, other] = [Content::of(&modules[0])?.operations, Content::of(&modules[1])?.operations];
        let verdict = verdict(&modules)?;
        Ok(format!("| {name} | {shipped} | {:+} | {verdict} |\n", shipped as i64 - other as i64))
    };
    row().map_err(Error::Environment)
}

fn verdict([shipped, other]: &[Vec<u32>; 2]) -> Result<String, String> {
    let hashes = |hash: fn(&[u32]) -> Result<String, String>| Ok::<_, String>([hash(shipped)?, hash(other)?]);
    let [exact, values] = [hashes(fingerprint::exact)?, hashes(fingerprint::values)?];
    if exact[0] == exact[1] {
        return Ok("equal".to_owned());
    }
    let kind = if values[0] == values[1] { "same values" } else { "differs" };
    let mut more: BTreeMap<String, i64> = BTreeMap::new();
    for (words, sign) in [(shipped, 1), (other, -1)] {
        let module = parse(bytemuck::cast_slice(words))?;
        operations(&module).for_each(|i| *more.entry(operation_name(i)).or_default() += sign);
    }
    let more = more.into_iter().filter(|(_, count)| *count != 0).map(|(name, count)| format!(", {name} {count:+}"));
    Ok(format!("{kind}{}", more.collect::<String>()))
}

fn report(rows: &str) -> String {
    format!(
        "# What is left of features that a scene has not\n\nThe shipped kernel `path`, flavour exact, frozen to all features but one and \
         optimised by spirv-opt twice, beside the same kernel built from source in which the code of that feature is compiled out, frozen and \
         optimised alike. Rows with \"diffuse\" are frozen to emissive triangles and the light table alone.\n\n\
         \"Equal\" modules have the same hash: the same operations in the same order, whatever the numbers of identifiers and the order of \
         declarations. Those with the \"same values\" have the same blocks, branches and stores and compute the same values equally often, but some \
         value stands earlier, or is copied by a shuffle that changes nothing. The others differ by the operations that the last column \
         counts; no label, branch, load or store is among them, so that no block of the feature is left, \
         and what remains is where spirv-opt, whose first run has to serve all scenes, shares vectors or takes them apart; \
         where the number is negative, the shipped module is the shorter one.\n\nMade by `cargo lab features --compiled-out --write` (10 min), which needs the shader toolchain; the name of a feature after \
         `--compiled-out` builds that one alone.\n\n\
         | without | operations | more than without its code | hash |\n|---|---:|---:|---|\n{rows}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_of_a_feature_become_truths() {
        let text = "pub const FEATURE_X: u32 = 1 << 3;\npub const FEATURE_XY: u32 = 16;\n\
                    if self.has(FEATURE_X) & (p.features() & FEATURE_X == 0) | has(FEATURE_XY) || q.features & FEATURE_X != 0 {}\n";
        let expected = "pub const FEATURE_X: u32 = 0;\npub const FEATURE_XY: u32 = 16;\n\
                        if false & (true) | has(FEATURE_XY) || false {}\n";
        assert_eq!(compiled_out(text, "FEATURE_X"), expected);
    }

    #[test]
    fn one_kernel_is_left() {
        let text = "mod kernel;\n\nfolders! {\n    check,\n    path,\n}\n\nfn rest() {}\n";
        assert_eq!(only(text, "folders!"), "mod kernel;\n\nfolders! { path }\n\nfn rest() {}\n");
    }

    /// A feature whose tests are written in another way would be compiled in, and nothing be seen of it.
    #[test]
    fn the_source_tests_for_every_feature() {
        let sources = read_files(&Workspace::current().root().join("shared/src")).unwrap();
        let texts: Vec<String> = sources.into_values().map(|bytes| String::from_utf8(bytes).unwrap()).collect();
        for (name, _) in parts() {
            let constant = constant(name);
            let declaration = format!("pub const {constant}: u32 = 0;");
            let edited: Vec<String> = texts.iter().map(|text| compiled_out(text, &constant)).collect();
            let declared = edited.iter().filter(|text| text.contains(&declaration)).count();
            let changed = edited.iter().zip(&texts).filter(|(edited, text)| edited != text).count();
            assert!(declared == 1 && changed > 1, "{constant}: declared {declared} times, {changed} files changed");
        }
    }
}
