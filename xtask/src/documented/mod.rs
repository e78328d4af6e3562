//! `cargo xtask documented`: runs the commands that README and docs name, and compares the pictures that they give with the committed ones.
//!
//! A command is a span of code, or a line of a block of `sh`, that begins with `restir` (also as `cargo run ... --`), `cargo lab` or
//! `cargo xtask` and holds neither `<` nor `...`. One that takes longer than half a minute carries its duration behind it, as in `(3 min)`; one without a duration
//! that takes longer than a minute fails. A picture below docs that a page shows has to be written by some command of a page: what renders has
//! the same bits everywhere, so that the file is the same byte for byte. The numbers of crates in README are compared with `cargo tree`.

mod crates;
mod output;
mod programs;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use self::output::Output;
use self::programs::Programs;
use crate::Error;
use crate::process::shell;

/// Where the pages are.
const PAGES: [&str; 2] = ["README.md", "docs"];
/// Below these folders lie reports, each of which names the command that made it; docs/measuring.md and docs/figures/README.md say how long it takes.
const MADE: [&str; 5] = ["docs/bench", "docs/bench-di", "docs/bench-gpu", "docs/bench-media", "docs/figures"];
/// A page beside reports that is no report.
const PAGE_BESIDE_REPORTS: &str = "docs/figures/README.md";
/// A command that takes longer has to say so. README's render on a software device takes 49 s on two idle cores, and a machine may be three
/// times as slow.
const LONGEST: Duration = Duration::from_secs(150);
/// What cargo writes before a command of the program.
const BY_CARGO: &str = "cargo run --release --bin restir -- ";
/// Subcommands of which a page speaks without meaning a command line.
const NAMES: [&str; 11] = [
    "render",
    "merge",
    "compare",
    "explain",
    "bench",
    "reference",
    "info",
    "export",
    "export-plan",
    "figure",
    "advise",
];

/// What to run.
#[derive(clap::Args)]
pub struct Options {
    /// Also what carries a duration.
    #[arg(long)]
    all: bool,
    /// Only commands with these words.
    #[arg(long, default_value = "")]
    with: String,
    /// Replace pictures that differ.
    #[arg(long)]
    write: bool,
    /// Only print the commands, and where they stand.
    #[arg(long)]
    list: bool,
}

/// A command line that a page names.
#[derive(Debug, PartialEq)]
struct Documented {
    line: String,
    /// As the page writes it.
    duration: Option<String>,
}

/// Runs them.
///
/// # Errors
/// If a command fails, gives another picture than the committed one, or if a picture that is shown has no command.
pub fn run(options: &Options) -> Result<(), Error> {
    let pages = pages()?;
    let commands = commands(&pages);
    let mut problems = orphans(&pages, &commands);
    if !options.list {
        problems.extend(crates::problems(&pages[Path::new(PAGES[0])])?);
    }
    let programs = Programs::build()?;
    let folder =
        workplace().map_err(|error| Error::Environment(format!("there is no folder to run commands in: {error}")))?;
    let chosen = commands.iter().filter(|(command, _)| command.line.contains(&options.with));
    for (command, page) in chosen {
        let duration = command.duration.as_deref();
        let left_out = duration.filter(|_| !options.all).map(|duration| format!("left out, {duration}"));
        if options.list || left_out.is_some() {
            println!("{page}: {} ({})", command.line, left_out.or(duration.map(str::to_owned)).unwrap_or_default());
            continue;
        }
        let start = Instant::now();
        let result = execute(command, &programs, folder.path(), options.write);
        println!("{page}: {} ({:.1} s)", command.line, start.elapsed().as_secs_f64());
        let is_long = duration.is_none() && start.elapsed() > LONGEST;
        let slow = is_long.then(|| format!("takes more than {} s; write how long behind it", LONGEST.as_secs()));
        problems.extend(
            result.err().into_iter().chain(slow).map(|problem| format!("{page}: `{}`: {problem}", command.line)),
        );
    }
    if problems.is_empty() { Ok(()) } else { Err(Error::Failed(problems.join("\n"))) }
}

/// All pages with their text.
fn pages() -> Result<BTreeMap<PathBuf, String>, Error> {
    fn walk(path: &Path, found: &mut BTreeMap<PathBuf, String>) -> std::io::Result<()> {
        if path.is_dir() {
            for entry in std::fs::read_dir(path)? {
                walk(&entry?.path(), found)?;
            }
        } else if path.extension().is_some_and(|ending| ending == "md") {
            found.insert(path.to_owned(), std::fs::read_to_string(path)?);
        }
        Ok(())
    }
    let mut found = BTreeMap::new();
    let read = PAGES.iter().try_for_each(|path| walk(Path::new(path), &mut found));
    read.map_err(|error| {
        Error::Environment(format!("cannot read the pages, run this at the workspace's root: {error}"))
    })?;
    let is_report = |path: &Path| MADE.iter().any(|made| path.starts_with(made));
    found.retain(|path, _| !is_report(path) || path == Path::new(PAGE_BESIDE_REPORTS));
    Ok(found)
}

/// The commands, each once, with the first page that names it.
fn commands(pages: &BTreeMap<PathBuf, String>) -> Vec<(Documented, String)> {
    let mut found: Vec<(Documented, String)> = Vec::new();
    for (page, text) in pages {
        for command in commands_of(text) {
            match found.iter_mut().find(|(known, _)| known.line == command.line) {
                Some((known, _)) => known.duration = known.duration.take().or(command.duration),
                None => found.push((command, page.display().to_string())),
            }
        }
    }
    found
}

fn commands_of(text: &str) -> Vec<Documented> {
    let mut found = Vec::new();
    for (index, part) in text.split("```").enumerate() {
        match part.strip_prefix("sh\n") {
            Some(block) if index % 2 == 1 => found.extend(block.lines().filter_map(|line| command(line, ""))),
            _ if index % 2 == 1 => (),
            _ => {
                let spans: Vec<&str> = part.split('`').collect();
                found.extend(
                    spans
                        .chunks(2)
                        .zip(spans.chunks(2).skip(1))
                        .filter_map(|(span, next)| command(span.get(1)?, next.first()?)),
                );
            }
        }
    }
    found
}

/// A command that can be run, with the text behind it.
fn command(span: &str, behind: &str) -> Option<Documented> {
    let line = span.split_whitespace().collect::<Vec<_>>().join(" ");
    let line = line.strip_prefix(BY_CARGO).map_or(line.clone(), |rest| format!("restir {rest}"));
    let words: Vec<&str> = line.split(' ').collect();
    let meant = match words.as_slice() {
        ["restir"] => false,
        ["restir", name] | ["cargo", "lab", name] => !NAMES.contains(name),
        ["restir", ..] | ["cargo", "lab" | "xtask", _, ..] => true,
        _ => false,
    };
    if !meant || line.contains(['<', '|']) || line.contains("...") {
        return None;
    }
    let duration = behind.strip_prefix(" (").and_then(|rest| rest.split_once(')')).map(|(inside, _)| inside.to_owned());
    let duration = duration.filter(|inside| [" s", " min", " h"].iter().any(|unit| inside.ends_with(unit)));
    Some(Documented { line, duration })
}

/// Pictures below docs that a page shows and no command writes, nor a script beside the page that it writes by `--out docs/x.md`, where
/// their names begin with the page's.
fn orphans(pages: &BTreeMap<PathBuf, String>, commands: &[(Documented, String)]) -> Vec<String> {
    let text: String = pages.values().map(String::as_str).collect();
    // pictures of figures lie in folders of their own, which are compared as wholes
    let of_docs = pages.iter().filter(|(path, _)| !path.starts_with("docs/figures"));
    let links = of_docs.flat_map(|(_, text)| text.split("](").skip(1));
    let shown = links.filter_map(|rest| rest.split_once(')')).map(|(path, _)| path);
    let shown = shown.filter(|path| path.ends_with(".png") && !path.contains("figures/"));
    let names: BTreeSet<&str> = shown.filter_map(|path| path.rsplit('/').next()).collect();
    let scripts: Vec<&str> =
        text.split("--out docs/").skip(1).filter_map(|rest| rest.split_once(".md")).map(|(stem, _)| stem).collect();
    let made = |name: &str| {
        let written = commands.iter().any(|(command, _)| Output::of(&command.line).writes(name));
        written || scripts.iter().any(|stem| name.starts_with(stem))
    };
    names
        .iter()
        .filter(|name| !made(name))
        .map(|name| format!("no page has a command that writes docs/{name}"))
        .collect()
}

/// Runs a command in the folder, where earlier ones have left their files. What it would write below docs is written into the folder, and
/// pictures are compared.
fn execute(command: &Documented, programs: &Programs, folder: &Path, write: bool) -> Result<(), String> {
    let output = Output::of(&command.line);
    let scratch = output.scratch(folder)?;
    let mut process = programs.command(&output.redirected(&command.line, &scratch), folder);
    let ended = process.output().map_err(|error| format!("cannot run {}: {error}", shell(&process)))?;
    if !ended.status.success() {
        return Err(format!("ended with {}: {}", ended.status, String::from_utf8_lossy(&ended.stderr).trim()));
    }
    output.judge(&scratch, write)
}

/// A folder where what commands read is found as at the workspace's root.
fn workplace() -> std::io::Result<tempfile::TempDir> {
    let folder = tempfile::tempdir()?;
    #[cfg(unix)]
    for name in ["assets", "docs"] {
        std::os::unix::fs::symlink(std::env::current_dir()?.join(name), folder.path().join(name))?;
    }
    Ok(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_found() {
        let text = "`restir scenes`, `restir render`, `restir render <scene> -o a.exr`, `restir render cornell -o c.exr --png docs/c.png` (3 min) and\n\
                    ```sh\ncargo run --release --bin restir -- compare a.exr b.exr\n```\n`cargo lab\naov`, `cargo lab bench`, `cargo test` or ![x](c.png) ![y](d.png)";
        let line = |line: &str| Documented { line: line.to_owned(), duration: None };
        let render = "restir render cornell -o c.exr --png docs/c.png";
        let long = Documented { line: render.to_owned(), duration: Some("3 min".to_owned()) };
        assert_eq!(
            commands_of(text),
            [line("restir scenes"), long, line("restir compare a.exr b.exr"), line("cargo lab aov")]
        );
        let pages = BTreeMap::from([(PathBuf::from("README.md"), text.to_owned())]);
        assert_eq!(orphans(&pages, &commands(&pages)), ["no page has a command that writes docs/d.png"]);
    }

    #[test]
    fn the_readme_embeds_the_example() {
        let readme = include_str!("../../../README.md");
        let block = readme.split("```rust\n").nth(1).and_then(|rest| rest.split("```").next());
        let example =
            include_str!("../../../restir/examples/two_devices.rs").lines().filter(|line| !line.starts_with("//!"));
        assert_eq!(block.map(|block| block.lines().collect()), Some(example.collect::<Vec<_>>()));
    }
}
