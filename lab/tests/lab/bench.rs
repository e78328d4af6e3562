//! `cargo lab bench`

use tempfile::TempDir;

use crate::read;
use crate::support::{Outcome, Workplace, finish, program, run, with_defaults};

/// A benchmark that takes less than a second, with a cache of its own.
fn bench(workplace: &Workplace, cache: &TempDir, more: &[&str]) -> Outcome {
    let mut command = program(["bench", "furnace", "--device", "cpu", "--cache"]);
    command.arg(cache.path());
    let out = ["--out", &workplace.output("")];
    let defaults = [["--spp", "1,2,4"], ["--restarts", "3"], ["--reference-spp", "1024"], out];
    finish(&mut with_defaults(command, &[&defaults[..], &SMALL].concat(), more))
}

const SMALL: [[&str; 2]; 2] = [["--size", "8x8"], ["--max-depth", "4"]];

/// Where a column is; no value before those that are asked for here holds a comma.
fn position(table: &str, name: &str) -> usize {
    table.lines().next().unwrap().split(',').position(|column| column == name).unwrap()
}

fn column(table: &str, name: &str) -> Vec<String> {
    let at = position(table, name);
    table.lines().skip(1).map(|line| line.split(',').nth(at).unwrap().to_owned()).collect()
}

/// The table with each value of a column changed.
fn with_column(table: &str, name: &str, change: impl Fn(&str) -> String) -> String {
    let at = position(table, name);
    let changed = |line: &str| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        fields[at] = change(&fields[at]);
        fields.join(",") + "\n"
    };
    let (header, rows) = table.split_once('\n').unwrap();
    format!("{header}\n{}", rows.lines().map(changed).collect::<String>())
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn a_benchmark_writes_its_report() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    let outcome = bench(&workplace, &cache, &["--technique", "path", "--technique", "path:roulette=on"]).done();
    assert_eq!(workplace.outputs(), ["furnace.svg", "report.csv", "report.md"]);
    let report = read(&workplace, "report.md");
    assert!(outcome.stdout.starts_with(&report), "the report is printed, too");
    assert!(report.contains("furnace.svg") && report.contains("1024 samples"), "{report}");
    let table = read(&workplace, "report.csv");
    assert_eq!(table.lines().count(), 1 + 2 * 3 * 3);
    assert_eq!(column(&table, "closest_rays")[0].parse(), Ok(4.0));
    bench(&workplace, &cache, &[]).done();
    assert_eq!(read(&workplace, "report.csv").lines().count(), 1 + 3 * 3, "the report of before was replaced");
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn what_got_worse_is_flagged() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    bench(&workplace, &cache, &[]).done();
    let text = read(&workplace, "report.csv");
    let better = with_column(&text, "mse", |error| format!("{:e}", error.parse::<f64>().unwrap() / 100.0));
    let same = workplace.input("same.csv", text.as_bytes());
    let better = workplace.input("better.csv", better.as_bytes());
    let worse = bench(&workplace, &cache, &["--against", &better]);
    assert_eq!(worse.code, Some(1), "{}", worse.stderr);
    let last = worse.stderr.lines().last().unwrap();
    assert!(last.starts_with("error: worse than") && last.contains("furnace path at 1 spp"), "{last}");
    assert!(worse.stdout.contains("**worse**"));
    // seeds are fixed, so errors are those of before; times may say what they like
    let unchanged = bench(&workplace, &cache, &["--against", &same]);
    assert!(unchanged.stdout.contains("1.000 of"), "{}", unchanged.stdout);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn a_poor_reference_gives_no_figures() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    bench(&workplace, &cache, &["--spp", "64", "--reference-spp", "128"]).says(&["reference too noisy"]);
    let table = read(&workplace, "report.csv");
    assert!(column(&table, "mse").iter().all(String::is_empty));
    assert!(table.lines().skip(1).all(|line| line.ends_with("reference too noisy")));
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn benchmarks_that_cannot_be() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    let text = workplace.input("text.csv", b"a,b\n1,2\n");
    let empty = workplace.input("empty.csv", b"");
    let refused = |more: &[&str], words: &[&str]| {
        bench(&workplace, &cache, more).refused(words);
        assert_eq!(workplace.outputs(), [""; 0]);
    };
    refused(&["teapot"], &["teapot", "cornell"]);
    refused(&["furnace"], &["furnace", "twice"]);
    refused(&["--restarts", "0"], &["--restarts 0", "2 to"]);
    refused(&["--spp", "1,0"], &["--spp", "at least 1"]);
    refused(&["--spp", "1,4294967295"], &["--spp 4294967295", "at most"]);
    refused(&["--spp", "1,x"], &["--spp", "natural number"]);
    refused(&["--reference-spp", "0"], &["--reference-spp"]);
    refused(&["--against", "missing.csv"], &["cannot read", "missing.csv"]);
    refused(&["--against", &text], &["cannot read", "text.csv", "line: 2", "scene", "report.csv"]);
    refused(&["--against", &empty], &["empty.csv", "no rows"]);
    refused(&["--technique", "pth"], &["pth", "path"]);
    refused(&["--technique", "path:jitter=on"], &["--jitter"]);
    refused(&["moving", "--technique", "restir-di", "--max-depth", "2"], &["moving", "one moment"]);
    refused(&["--technique", "path", "--technique", "path"], &["path", "twice"]);
    refused(&["--max-depth", "0"], &["depth"]);
    refused(&["--size", "0x8"], &["image"]);
    refused(&["--out", &workplace.input("file", b"")], &["cannot write", "--out"]);
    run(["bench"]).refused(&[]);
}

/// A folder's name may hold what a terminal would take for more: what was written is told without it.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn names_of_what_was_written_are_only_names() {
    let workplace = Workplace::new();
    let out = workplace.output("a\u{1b}]0;title\u{7}\u{202e}");
    let bench = ["bench", "cornell", "--size", "4x3", "--reference-spp", "128", "--seconds", "0", "--restarts", "2"];
    let outcome = run(bench.iter().chain(&["--out", &out])).done();
    let text = outcome.stdout + &outcome.stderr;
    assert!(text.contains("wrote") && text.contains("title"), "{text}");
    assert!(!text.contains(|c: char| c != '\n' && c.is_control() || c == '\u{202e}'), "{text:?}");
}

/// A table is judged by its length before it is read.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn large_tables_are_refused() {
    let workplace = Workplace::new();
    let table = workplace.input("report.csv", &vec![b'1'; 1 << 20]);
    let mut command = program(["bench", "cornell", "--against", &table, "--out", &workplace.output("bench")]);
    let words = ["the table", "report.csv would take 8.0 MiB", "cargo lab bench"];
    workplace.refuses(command.env("RESTIR_MEMORY_LIMIT_BYTES", "4000000"), &words);
    workplace.refuses(command.env("RESTIR_MEMORY_LIMIT_BYTES", "40000000"), &["cannot read", "report.csv"]);
}

/// The table that a benchmark is compared with is the one that its own would replace, if no folder is named.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn a_benchmark_keeps_what_it_is_compared_with() {
    let workplace = Workplace::new();
    let [out, cache] = ["bench", "cache"].map(|name| workplace.output(name));
    let bench = ["bench", "cornell", "--size", "4x3", "--reference-spp", "128", "--seconds", "0", "--restarts", "2"];
    let run = |more: &[&str]| run([&bench[..], &["--cache", &cache, "--out", &out], more].concat());
    run(&[]).done();
    let table = format!("{out}/report.csv");
    let before = std::fs::read(&table).unwrap();
    run(&["--against", &table]).refused(&["is also read"]);
    assert_eq!(std::fs::read(&table).unwrap(), before);
}
