//! The map of modules in ARCHITECTURE.md is that of the code, a module uses only those above it, and nothing but its own folders
//! names a technique.

use restir_host::technique;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

restir_tests::suite! {
    first {
        modules_use_only_those_above_them
        disorder_is_seen
        a_technique_is_named_in_its_folders_alone
        a_name_elsewhere_is_seen
        every_public_module_has_an_example
        a_module_without_an_example_is_seen
    }
}

/// Crates of the map: their names there, and where their sources are.
const CRATES: [(&str, &str); 6] = [
    ("restir-shared", "shared/src"),
    ("restir-kernels", "kernels/src"),
    ("restir-host", "host/src"),
    ("restir-cli", "host/program/src"),
    ("restir-lab", "lab/src"),
    ("xtask", "xtask/src"),
];

/// Of every technique but the reference: what may name it beside its own folders. The lists of techniques, the reports and figures
/// of papers, and what tells which bits of a plane's words are a number.
const MAY_NAME: [&str; 16] = [
    "shared/src/technique",
    "host/src/technique",
    "tests/src/technique",
    "tests/src/visibility",
    "tests/src/words",
    "lab/src/denoised/subjects",
    "lab/src/device/subjects",
    "lab/src/figure",
    "lab/src/gains",
    "lab/src/gains/correlated",
    "lab/src/gains/study",
    "lab/src/reuse",
    "lab/src/reuse/limits",
    "lab/src/shifts",
    "lab/src/simd",
    "lab/src/visibility",
];
/// Techniques of which one shares the other's records and kernels, and so names it.
const SHARES_WITH: [(&str, &str); 1] = [("restir-suffix", "restir-pt")];
/// All others are compared with it.
const REFERENCE: &str = "path";

/// A source file: the path of its module, and the text without comments and unit tests.
struct Source {
    module: Vec<String>,
    text: String,
}

fn source(path: &str, text: &str) -> Source {
    Source { module: path.split("::").map(str::to_owned).collect(), text: without_tests(text) }
}

/// The modules of a crate in the map, leaf first: a row `| crate | a, b, c |`.
fn map_of(document: &str, name: &str) -> Vec<String> {
    let head = format!("| `{name}` modules | ");
    let row = document.lines().find_map(|line| line.strip_prefix(&head)).unwrap_or_default();
    row.trim_end_matches(" |").split(';').next().unwrap_or_default().split(", ").map(str::to_owned).collect()
}

/// All files below a folder of the workspace that are compiled outside of tests.
fn sources(folder: &str) -> Vec<Source> {
    let mut found = Vec::new();
    add_sources(&workspace().join(folder), &[], &mut found);
    found
}

/// The file at the root of a crate, without comments.
fn root(folder: &str) -> String {
    let files = ["lib.rs", "main.rs"].map(|name| workspace().join(folder).join(name));
    without_comments(&read(files.iter().find(|file| file.exists()).expect("the root of a crate")))
}

fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace")
}

fn add_sources(root: &Path, module: &[String], found: &mut Vec<Source>) {
    let file = ["mod.rs", "lib.rs", "main.rs"].into_iter().map(|name| root.join(name)).find(|file| file.exists());
    let of_tests = file.map_or_else(BTreeSet::new, |file| test_modules(&read(&file)));
    let entries: BTreeSet<_> =
        root.read_dir().expect("a folder of sources").flatten().map(|entry| entry.path()).collect();
    for path in entries {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if of_tests.contains(&stem) || stem == "lib" || stem == "main" {
            continue;
        }
        let module = [module, if stem == "mod" { &[] } else { std::slice::from_ref(&stem) }].concat();
        if path.is_dir() {
            add_sources(&path, &module, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(Source { module, text: without_tests(&read(&path)) });
        }
    }
}

fn read(file: &Path) -> String {
    std::fs::read_to_string(file).expect("a source file")
}

fn without_comments(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

fn without_tests(text: &str) -> String {
    let text = without_comments(text);
    text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default().to_owned()
}

/// Modules that a file declares for tests.
fn test_modules(text: &str) -> BTreeSet<String> {
    let after = without_comments(text);
    let names = after.split("#[cfg(test)]\nmod ").skip(1).filter_map(|rest| rest.split(';').next());
    names.map(str::to_owned).collect()
}

/// The names that follow a path such as `crate::`, one or several in braces.
fn names_after<'a>(text: &'a str, path: &str) -> Vec<&'a str> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let name = |text: &'a str| text.trim_start().split(|c| !is_word(c)).next().unwrap_or_default();
    let nest = |depth: &mut i32, c| {
        *depth += i32::from(c == '{') - i32::from(c == '}');
        *depth
    };
    let names = text.match_indices(path).flat_map(|(at, _)| {
        let rest = &text[at + path.len()..];
        let Some(group) = rest.strip_prefix('{') else { return vec![name(rest)] };
        let (mut outer, mut inner) = (1, 0);
        let end = group.find(|c| nest(&mut outer, c) == 0).unwrap_or(group.len());
        let entries = group[..end].split(|c| nest(&mut inner, c) == 0 && c == ',');
        entries.filter(|entry| !entry.trim().is_empty()).map(name).collect()
    });
    names.collect()
}

/// The text of a file with the paths of modules inside of it as if these were not there: one `super::` of each path leads to the file itself.
fn without_inner_modules(text: &str) -> String {
    let mut parts = text.split("\nmod ");
    let mut outer = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end =
            if part.lines().next().unwrap_or_default().ends_with('{') { part.find("\n}").unwrap_or(0) } else { 0 };
        outer.extend(["\nmod ", &part[..end].replace(" super::", " "), &part[end..]]);
    }
    outer
}

/// What the root of a crate has beside its modules, each with the module that it is of, or none if it is another crate: what the root
/// takes by `use`, and macros that modules export. A module that it takes out of another one is not among them, since it hides where it lies.
fn items(root: &str, sources: &[Source]) -> BTreeMap<String, Option<String>> {
    let is_module = |path: [&str; 2]| sources.iter().any(|source| source.module.starts_with(&path.map(str::to_owned)));
    let uses = root.split(';').filter_map(|statement| Some(statement.rsplit_once("use ")?.1));
    let taken = uses.flat_map(|path| {
        let Some((module, names)) = path.split_once("::") else { return vec![(path.to_owned(), None)] };
        let names = names.rsplit("::").next().unwrap_or_default().trim_matches(['{', '}']).split(',').map(str::trim);
        let named = names.filter(|name| !is_module([module, name]));
        named.map(|name| (name.rsplit(' ').next().unwrap_or_default().to_owned(), Some(module.to_owned()))).collect()
    });
    let macros = sources.iter().flat_map(|Source { module, text }| {
        let exported = text.split("#[macro_export]\nmacro_rules! ").skip(1);
        exported.map(|rest| (rest.split(' ').next().unwrap_or_default().to_owned(), Some(module[0].clone())))
    });
    taken.chain(macros).collect()
}

/// What of the code disagrees with a map.
fn disagreements(map: &[String], root: &str, sources: &[Source]) -> Vec<String> {
    let modules: BTreeSet<&String> = sources.iter().map(|source| &source.module[0]).collect();
    let mut findings: Vec<String> =
        modules.iter().filter(|m| !map.contains(m)).map(|m| format!("{m} is not listed")).collect();
    findings.extend(map.iter().filter(|m| !modules.contains(m)).map(|m| format!("{m} does not exist")));
    let items = items(root, sources);
    let rank = |name: &str| map.iter().position(|listed| listed == name);
    for Source { module, text } in sources {
        let (up, text) = (format!(" {}", "super::".repeat(module.len())), without_inner_modules(text));
        for name in names_after(&text, "crate::").into_iter().chain(names_after(&text, &up)) {
            let Some(home) = items.get(name).map_or(Some(name), Option::as_deref) else { continue };
            let wrong = match rank(home) {
                _ if home == module[0] => continue,
                Some(used) if Some(used) < rank(&module[0]) => continue,
                Some(_) => "is not above it",
                None => "is in no map",
            };
            findings.push(format!("{} uses {name}, which {wrong}", module.join("::")));
        }
    }
    findings
}

fn modules_use_only_those_above_them() {
    let document = read(&workspace().join("ARCHITECTURE.md"));
    let of_crate = |(name, folder)| {
        let (root, sources) = (root(folder), sources(folder));
        // a technique's own folder at the root of a crate is below all that the map lists
        let techniques = technique::all().into_iter().map(|technique| technique.about().name.replace('-', "_"));
        let own = techniques.filter(|folder| sources.iter().any(|source| source.module[0] == *folder));
        let map: Vec<String> = map_of(&document, name).into_iter().chain(own).collect();
        let found = disagreements(&map, &root, &sources);
        found.into_iter().map(move |finding| format!("{name}: {finding}"))
    };
    let findings: Vec<String> = CRATES.into_iter().flat_map(of_crate).collect();
    assert!(findings.is_empty(), "{}", findings.join("\n"));
}

/// A module that uses one below it, by any way of naming it, a circle, what is in no map, and modules that the map and the code do not
/// share.
fn disorder_is_seen() {
    let map: Vec<String> = ["leaf", "middle", "top"].map(str::to_owned).into();
    let root = "pub mod top;\npub use leaf::{A, Old as New};\n#[cfg(any)]\npub use glam;\npub use top::hidden;\nuse top::deep::C;";
    let check = |texts: [&str; 3]| {
        let [leaf, middle, top] = texts;
        let files =
            [source("leaf", leaf), source("middle::deep", middle), source("top", top), source("top::hidden", "")];
        disagreements(&map, root, &files)
    };
    assert!(check(["", "use crate::leaf::A;", "use crate::{leaf, middle::B};\nuse super::leaf;"]).is_empty());
    assert!(check(["// crate::top\n#[cfg(test)]\nmod tests {\n use crate::top;\n}", "", ""]).is_empty());
    assert!(
        check(["use crate::New;", "use crate::{A, glam::Vec3};", "use crate::C;\nuse crate::top::hidden;"]).is_empty()
    );
    assert!(check(["#[macro_export]\nmacro_rules! m {}", "crate::m!()", ""]).is_empty());
    assert!(
        check(["\nmod inner {\n    use super::{f, g};\n}\n", "", "\nmod inner {\n    use super::super::leaf;\n}\n"])
            .is_empty()
    );
    for wrong in [
        ["use crate::top::C;", "", ""],
        ["use crate::{\n    leaf::{self, B},\n    top,\n};", "", ""],
        ["", "use super::super::top;", ""],
        ["use crate::middle;", "use crate::leaf;", ""],
        ["fn f() { crate::top::g() }", "", ""],
        ["\nmod inner {\n    use super::super::top;\n}\n", "", ""],
        ["use crate::C;", "", ""],
        ["crate::m!()", "#[macro_export]\nmacro_rules! m {}", ""],
        ["use crate::Old;", "", ""],
        ["", "", "use crate::unknown::D;"],
        // half of a circle within `top`, by a name that hides it
        ["", "", "use crate::hidden::E;"],
    ] {
        assert_eq!(check(wrong).len(), 1, "{wrong:?}");
    }
    assert_eq!(disagreements(&map, "", &[source("leaf", ""), source("other", "")]).len(), 3);
}

/// The folders that a technique has in the crates: named as it is, or by the last word of its name.
fn folders(technique: &str) -> [String; 2] {
    [technique.replace('-', "_"), technique.rsplit('-').next().unwrap_or(technique).to_owned()]
}

/// Where a crate's files name a technique that is not theirs: by its name, its folders or its settings.
fn namings(technique: &str, folder: &str, sources: &[Source]) -> Vec<String> {
    let [long, short] = folders(technique);
    let settings = format!("{}{}Settings", short[..1].to_uppercase(), &short[1..]);
    let words = [format!("\"{technique}"), long.clone(), format!("::{short}::"), format!("::{short};"), settings];
    let sharing = SHARES_WITH.iter().filter(|(_, with)| *with == technique).map(|(who, _)| folders(who)[0].clone());
    let own: Vec<String> = [long.clone(), short.clone()].into_iter().chain(sharing).collect();
    let is_own = |source: &Source| source.module.iter().any(|module| own.contains(module));
    let may = |source: &Source| {
        let path = format!("{folder}/{}", source.module.join("/"));
        MAY_NAME.iter().any(|may| path == *may || may.ends_with("figure") && path.starts_with(may))
    };
    let elsewhere = sources.iter().filter(|source| !is_own(source) && !may(source));
    let lines = elsewhere.flat_map(|source| source.text.lines().map(move |line| (source.module.join("::"), line)));
    let named = lines.filter(|(_, line)| words.iter().any(|word| line.contains(word.as_str())));
    named.map(|(module, line)| format!("{folder}: {module}: {}", line.trim())).collect()
}

fn a_technique_is_named_in_its_folders_alone() {
    let mut named = Vec::new();
    for folder in CRATES.map(|(_, folder)| folder).into_iter().chain(["tests/src"]) {
        let found = sources(folder);
        let names = technique::all().into_iter().map(|technique| technique.about().name);
        named.extend(names.filter(|name| *name != REFERENCE).flat_map(|name| namings(name, folder, &found)));
    }
    assert!(named.is_empty(), "{}", named.join("\n"));
}

fn a_name_elsewhere_is_seen() {
    let source = |path| source(path, "use crate::technique::restir_di::DiSettings;");
    assert!(namings("restir-di", "host/src", &[source("technique::restir_di::plan")]).is_empty());
    assert_eq!(namings("restir-di", "host/src", &[source("exec::cpu")]).len(), 1);
}

/// Crates that others depend on, by their sources.
const PUBLISHED: [&str; 4] = ["shared/src", "kernels/src", "host/src", "restir/src"];

/// The file of a module, given by its path without an ending.
fn file_of(module: &Path) -> PathBuf {
    let beside = module.with_extension("rs");
    if beside.exists() { beside } else { module.join("mod.rs") }
}

/// The public modules that a file declares, techniques and folders of kernels among them, and what the documentation hides not. What else
/// macros declare are kernels: of these a module is one descriptor, and the example of their folder shows one.
fn public_modules(text: &str) -> Vec<String> {
    let text = without_comments(text).replace("#[doc(hidden)]\n", "#[doc(hidden)]");
    let listed = |head: &str| -> Vec<String> {
        let list = text.split(head).nth(1).and_then(|rest| rest.split('}').next()).unwrap_or_default();
        let names = list.split(',').map(|entry| entry.split(':').next().unwrap_or_default().trim());
        names.filter(|name| !name.is_empty() && !name.starts_with('#')).map(str::to_owned).collect()
    };
    let declared = text.lines().filter_map(|line| line.trim().strip_prefix("pub mod ")?.strip_suffix(';'));
    let declared = declared.map(str::to_owned);
    [listed("\ntechniques! {"), listed("\nfolders! {")].concat().into_iter().chain(declared).collect()
}

/// Whether the documentation of a module has an example that runs, or on a GPU is compiled alone.
fn has_example(text: &str, needs_gpu: bool) -> bool {
    let lines = text.lines().map_while(|line| line.strip_prefix("//!").or(line.strip_prefix("#![doc")));
    let mut is_open = false;
    lines.map(str::trim).filter(|line| line.starts_with("```")).any(|fence| {
        is_open = !is_open;
        is_open && (fence == "```" || needs_gpu && fence == "```no_run")
    })
}

/// The public modules below a file, itself included, that have no example.
fn without_example(file: &Path, folder: &Path, name: &str, missing: &mut Vec<String>) {
    let text = read(file);
    if !has_example(&text, name.ends_with("gpu")) {
        missing.push(name.to_owned());
    }
    for module in public_modules(&text) {
        let path = folder.join(&module);
        without_example(&file_of(&path), &path, &format!("{name}::{module}"), missing);
    }
}

fn every_public_module_has_an_example() {
    let mut missing = Vec::new();
    for source in PUBLISHED {
        let folder = workspace().join(source);
        without_example(&folder.join("lib.rs"), &folder, source, &mut missing);
    }
    assert!(missing.is_empty(), "without an example in their documentation: {}", missing.join(", "));
}

fn a_module_without_an_example_is_seen() {
    let example = "//! What it is.\n//!\n//! ```\n//! assert!(true);\n//! ```\n\nuse a::b;";
    assert!(has_example(example, false));
    assert!(has_example("//! ```text\n//! a -> b\n//! ```\n//!\n//! ```\n//! f();\n//! ```", false));
    assert!(!has_example("//! ```text\n//! a -> b\n//! ```\n", false), "a figure is no example");
    assert!(!has_example("//! What it is.\n\n/// ```\n/// f();\n/// ```\nfn f() {}", false), "it stands elsewhere");
    let compiled = example.replacen("```", "```no_run", 1);
    assert!(!has_example(&compiled, false) && has_example(&compiled, true));
    let text = "mod a;\npub mod b;\n// pub mod c;\n#[doc(hidden)]\npub mod h;\ntechniques! {\n    d: Settings,\n}\n";
    assert_eq!(public_modules(text), ["d", "b"]);
    assert_eq!(public_modules("\nfolders! {\n    #[doc(hidden)]\n    check,\n    film,\n}\n"), ["film"]);
}
