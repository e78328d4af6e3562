//! The code against ARCHITECTURE.md: modules use only those before them, and nothing but its own folders names a technique.

use libtest_mimic::Failed;
use restir_host::technique;
use restir_tests::suite::{ensure, run};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Crates with their folders of sources, whose lists of modules ARCHITECTURE.md has.
const CRATES: [(&str, &str); 4] = [
    ("restir-shared", "shared/src"),
    ("restir-kernels", "kernels/src"),
    ("restir-host", "host/src"),
    ("restir", "host/program/src"),
];
/// Of every technique but the reference: what may name it beside its own folders. The lists of techniques, figures and reports of
/// papers, and the suites that are about it.
const MAY_NAME: [&str; 11] = [
    "shared/src/technique/mod.rs",
    "kernels/src/lib.rs",
    "host/src/technique/mod.rs",
    "host/src/technique/registry.rs",
    "host/program/src/figure/",
    "tests/src/technique/mod.rs",
    "tests/src/visibility.rs",
    "xtask/src/visibility.rs",
    "tests/tests/",
    "host/program/tests/",
    "xtask/tests/",
];
/// All others are compared with it.
const REFERENCE: &str = "path";

fn main() -> ExitCode {
    run(&[
        ("modules_use_only_those_before_them", modules_use_only_those_before_them),
        ("what_is_used_before_its_place_is_seen", what_is_used_before_its_place_is_seen),
        ("a_technique_is_named_in_its_folders_alone", a_technique_is_named_in_its_folders_alone),
        ("a_name_elsewhere_is_seen", a_name_elsewhere_is_seen),
    ])
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// All Rust files below a folder: paths from the workspace's root, and their text without unit tests.
fn sources(folder: &str) -> Result<Vec<(String, String)>, Failed> {
    let mut files = Vec::new();
    let mut folders = vec![PathBuf::from(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root().join(&folder))? {
            let (entry, path) = {
                let entry = entry?;
                (entry.path(), folder.join(entry.file_name()))
            };
            if entry.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push((path.to_string_lossy().replace('\\', "/"), code(&std::fs::read_to_string(&entry)?)));
            }
        }
    }
    Ok(files)
}

/// A file's code: without comments and without what is compiled for unit tests only.
fn code(text: &str) -> String {
    let tests = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    let lines = text[..tests].lines().filter(|line| !line.trim_start().starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

/// The modules of a crate in the order of ARCHITECTURE.md.
fn map(document: &str, name: &str) -> Result<Vec<String>, Failed> {
    let marker = format!("* `{name}`: ");
    let start = document.find(&marker).ok_or_else(|| Failed::from(format!("ARCHITECTURE.md has no list of {name}")))?;
    let list = &document[start + marker.len()..];
    let end = list.find("\n* ").or_else(|| list.find("\n\n")).unwrap_or(list.len());
    let end = list.find("\n\n").map_or(end, |blank| end.min(blank));
    Ok(list[..end].split(',').map(|module| module.trim().to_owned()).collect())
}

/// The modules that follow `crate::` in code, also in groups.
fn used(code: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let name = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    for (at, marker) in code.match_indices("crate::") {
        let rest = &code[at + marker.len()..];
        let Some(group) = rest.strip_prefix('{') else {
            names.insert(name(rest));
            continue;
        };
        let (mut depth, mut part) = (0, String::new());
        for c in group.chars() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    names.insert(name(part.trim()));
                    part.clear();
                }
                _ if depth == 0 => part.push(c),
                _ => {}
            }
        }
        names.insert(name(part.trim()));
    }
    names
}

/// Uses of modules that do not come before the one that uses them, and modules that the list lacks. Files for unit tests do
/// not count.
fn violations(order: &[String], folder: &str, files: &[(String, String)]) -> Vec<String> {
    let of_tests: Vec<String> = files.iter().flat_map(|(path, text)| test_modules(path, text)).collect();
    let place = |module: &str| order.iter().position(|listed| listed == module);
    let mut found = Vec::new();
    for (path, text) in files {
        let inner = path.trim_start_matches(folder).trim_start_matches('/');
        let module = inner.split('/').next().unwrap_or_default().trim_end_matches(".rs");
        if ["lib", "main", "kernel"].contains(&module) || of_tests.iter().any(|tests| path.starts_with(tests.as_str()))
        {
            continue;
        }
        let Some(here) = place(module) else {
            found.push(format!("{path}: the list lacks {module}"));
            continue;
        };
        let later = used(text).into_iter().filter(|used| place(used).is_some_and(|there| there > here));
        found.extend(later.map(|used| format!("{path} uses {used}, which comes after {module}")));
    }
    found
}

/// What a file declares for unit tests only.
fn test_modules(path: &str, text: &str) -> Vec<String> {
    let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder);
    let stem = path.trim_end_matches(".rs");
    let declared = text.split("#[cfg(test)]\nmod ").skip(1);
    let names = declared.filter_map(|rest| rest.split_once(';')).map(|(name, _)| name.trim());
    names.flat_map(|name| [format!("{folder}/{name}"), format!("{stem}/{name}")]).collect()
}

fn modules_use_only_those_before_them() -> Result<(), Failed> {
    let document = std::fs::read_to_string(root().join("ARCHITECTURE.md"))?;
    for (name, folder) in CRATES {
        let order = map(&document, name)?;
        let found = violations(&order, folder, &sources(folder)?);
        ensure(found.is_empty(), || format!("{name}:\n{}", found.join("\n")))?;
        let missing: Vec<&String> = order
            .iter()
            .filter(|module| ["", "/mod"].iter().all(|end| !root().join(format!("{folder}/{module}{end}.rs")).exists()))
            .collect();
        ensure(missing.is_empty(), || format!("{name}: ARCHITECTURE.md lists {missing:?}, which there are not"))?;
    }
    Ok(())
}

fn what_is_used_before_its_place_is_seen() -> Result<(), Failed> {
    let order = ["low", "middle", "high"].map(str::to_owned);
    let file = |path: &str, text: &str| (path.to_owned(), text.to_owned());
    let right = [file("x/low.rs", ""), file("x/high/mod.rs", "use crate::{low::A, middle};")];
    ensure(violations(&order, "x", &right).is_empty(), || "the right order is refused".to_owned())?;
    for wrong in ["use crate::high;", "use crate::{low, high::{A, B}};", "fn f() { crate::high::g() }"] {
        let found = violations(&order, "x", &[file("x/middle.rs", wrong)]);
        ensure(found.len() == 1, || format!("{wrong}: {found:?}"))?;
    }
    ensure(violations(&order, "x", &[file("x/other.rs", "")]).len() == 1, || "an unlisted module passes".to_owned())
}

/// The words by which code can name a technique: its name, and those of its folders.
fn words(technique: &str) -> Vec<String> {
    let short = technique.rsplit('-').next().unwrap_or(technique);
    vec![
        format!("\"{technique}"),
        technique.replace('-', "_"),
        format!("technique::{short}"),
        format!("::{short}::"),
        format!("{}{}Settings", short[..1].to_uppercase(), &short[1..]),
    ]
}

/// Where files name a technique that is not theirs.
fn namings(technique: &str, files: &[(String, String)]) -> Vec<String> {
    let words = words(technique);
    let own = |path: &str| {
        let short = technique.rsplit('-').next().unwrap_or(technique);
        let folders = [technique.replace('-', "_"), short.to_owned()];
        path.split(['/', '.']).any(|part| folders.iter().any(|folder| part == folder))
    };
    let elsewhere = files.iter().filter(|(path, _)| !own(path) && !MAY_NAME.iter().any(|may| path.starts_with(may)));
    let lines = elsewhere.flat_map(|(path, text)| text.lines().map(move |line| (path, line)));
    let named = lines.filter(|(_, line)| words.iter().any(|word| line.contains(word.as_str())));
    named.map(|(path, line)| format!("{path}: {}", line.trim())).collect()
}

fn a_technique_is_named_in_its_folders_alone() -> Result<(), Failed> {
    let folders = ["shared/src", "kernels/src", "host/src", "host/program/src", "tests/src", "xtask/src"];
    let files = folders.iter().map(|folder| sources(folder)).collect::<Result<Vec<_>, _>>()?.concat();
    for technique in technique::all().iter().map(|technique| technique.about().name).filter(|name| *name != REFERENCE) {
        let found = namings(technique, &files);
        ensure(found.is_empty(), || format!("{technique} is named in\n{}", found.join("\n")))?;
    }
    Ok(())
}

fn a_name_elsewhere_is_seen() -> Result<(), Failed> {
    let file = |path: &str| (path.to_owned(), "use restir_host::technique::restir_di::DiSettings;".to_owned());
    ensure(namings("restir-di", &[file("host/src/technique/restir_di/plan.rs")]).is_empty(), || "its own".to_owned())?;
    ensure(namings("restir-di", &[file("host/src/exec/cpu.rs")]).len() == 1, || "not seen".to_owned())
}
