//! `cargo lab device`

use crate::adapter::adapter_is_there;
use crate::support::{Outcome, Workplace, finish, program};

/// What is no program at all.
const OTHER: &str = env!("CARGO_MANIFEST_DIR");

fn device(arguments: &[&str]) -> Outcome {
    finish(program(["device", "--quick"]).args(arguments))
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn rays_alone_are_measured() {
    if !adapter_is_there() {
        return;
    }
    let outcome = device(&["--only", "traversal"]).says(&["## Traversal alone", "none differs", "| exact, Mrays/s |"]);
    for kind in ["primary", "diffuse bounce", "shadow"] {
        let rows = outcome.stdout.lines().filter(|line| line.starts_with(&format!("| {kind}: ")));
        let rates = rows.map(|row| row.trim_end_matches(" |").rsplit(" | ").next().unwrap().parse::<f64>().unwrap());
        let rates: Vec<f64> = rates.collect();
        assert!(rates.len() == 2 && rates.iter().all(|rate| *rate > 0.0), "{kind}: {rates:?}");
    }
    assert!(!outcome.stdout.contains("## Techniques"), "{}", outcome.stdout);
}

#[test]
fn what_does_not_measure_is_refused() {
    let workplace = Workplace::new();
    let missing = workplace.output("no-program");
    for (other, words) in
        [(missing.as_str(), ["no-program", "cannot be run"]), (OTHER, ["cannot be run", "cargo lab device"])]
    {
        device(&["--against", other]).refused(&words);
    }
    device(&["--against", &missing, "--only", "first"]).refused(&["leave first out"]);
    device(&["--against", &missing, "--write"]).refused(&["--write"]);
    device(&["--only", "everything"]).refused(&["everything", "traversal"]);
}

/// Programs that do something else: one that prints nothing, one that fails, and one that prints what is no row.
#[test]
#[cfg(unix)]
fn what_prints_no_rows_is_refused() {
    for (other, words) in [("true", "there are none"), ("false", "does not measure"), ("echo", "line 1")] {
        let path = ["/bin", "/usr/bin"].map(|folder| format!("{folder}/{other}"));
        let path = path.iter().find(|path| std::path::Path::new(path).exists()).unwrap();
        device(&["--against", path]).refused(&[path, words, "give the program `lab`"]);
    }
}
