//! `cargo lab figure`

use restir::image::{Image, write_exr};
use tempfile::TempDir;

use crate::read;
use crate::support::{Outcome, Workplace, finish, program, run};

/// A figure of a few pixels, with a cache of its own.
fn figure(workplace: &Workplace, cache: &TempDir, more: &[&str]) -> Outcome {
    let mut command = program(["figure", "--device", "cpu", "--size", "16x12", "--out", &workplace.output("")]);
    finish(command.arg("--cache").arg(cache.path()).args(more))
}

/// The lines of a report's table of claims that name `id`, and what the last column says.
fn verdicts(report: &str, id: &str) -> Vec<String> {
    let rows = report.lines().filter(|line| line.starts_with(&format!("| {id}")));
    rows.map(|line| line.trim_end_matches(" |").rsplit(" | ").next().unwrap().to_owned()).collect()
}

/// Every row of a table has as many columns as its names.
fn assert_table(csv: &str, rows: usize) {
    // names of configurations hold commas, and are quoted
    let columns = |line: &str| line.split('"').step_by(2).map(|part| part.matches(',').count()).sum::<usize>();
    let mut lines = csv.lines();
    let names = lines.next().map(columns);
    assert!(lines.clone().all(|line| Some(columns(line)) == names), "{csv}");
    assert_eq!(lines.count(), rows);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn error_over_time_by_form_of_mis() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    let few = ["--quick", "--restarts", "4", "--frames", "3", "--reference-spp", "256"];
    let outcome = figure(&workplace, &cache, &[&["bitterli2020-fig1"][..], &few].concat()).done();
    let plots = ["many-lights.svg", "report.md", "statue.svg", "wall.svg"];
    assert_eq!(workplace.outputs(), [&["chains.csv", "curves.csv"], &plots[..]].concat());
    let report = read(&workplace, "report.md");
    assert!(outcome.stdout.starts_with(&report), "the report is printed, too");
    // what does not depend on how much was measured: no ray for MIS without visibility reuse
    assert_eq!(verdicts(&report, "B23"), ["yes"; 3], "{report}");
    for id in ["B20", "B21", "B22", "B6", "B7", "B24", "B19"] {
        assert!(!verdicts(&report, id).is_empty(), "{id}");
    }
    // eight configurations and eight of candidates on three scenes, two on two walls, four chains each
    assert_table(&read(&workplace, "chains.csv"), (3 * 16 + 2 * 2) * 4);
    // four curves of 1, 2 and 4 chains and of up to 8 frames, on three scenes
    assert_table(&read(&workplace, "curves.csv"), 3 * 4 * (3 + 4));
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn the_visibility_term() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    figure(&workplace, &cache, &["tokuyoshi-fig1", "--restarts", "1", "--frames", "24"]).done();
    assert_eq!(workplace.outputs(), ["images.png", "report.md", "tiles.csv"]);
    let report = read(&workplace, "report.md");
    // the samples are the same bits with and without averaging, and there are two rays a pixel, of any picture
    assert_eq!([verdicts(&report, "T18"), verdicts(&report, "T17")], [["yes"], ["yes"]], "{report}");
    assert!(report.contains(&format!("0 of {} differ", 24 * 16 * 12)), "{report}");
    assert_table(&read(&workplace, "tiles.csv"), 2 * 2);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn the_converged_trio() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    let more = ["tokuyoshi-fig2", "--restarts", "4", "--frames", "4", "--reference-spp", "256"];
    figure(&workplace, &cache, &more).done();
    assert_eq!(workplace.outputs(), ["images.png", "pixels.csv", "report.md"]);
    let report = read(&workplace, "report.md");
    assert!(report.contains("RMSPE(ours, prev)") && verdicts(&report, "T21").len() == 3, "{report}");
    assert_table(&read(&workplace, "pixels.csv"), 16 * 12);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn colours_by_mean_free_path() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    figure(&workplace, &cache, &["zhang2025-grid", "--frames", "4"]).done();
    assert_eq!(workplace.outputs(), ["cells.csv", "images.png", "report.md"]);
    let report = read(&workplace, "report.md");
    assert!(verdicts(&report, "G1").len() == 1 && verdicts(&report, "G2").len() == 1, "{report}");
    assert_table(&read(&workplace, "cells.csv"), 4 * 5);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn borrowed_suffixes_and_prefixes() {
    for (name, id, claims, settings) in [("kettunen2023-fig3", "K3", 3, 8), ("kettunen2023-fig4", "K4", 7, 15)] {
        let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
        figure(&workplace, &cache, &[name, "--quick", "--restarts", "4", "--frames", "3"]).done();
        assert_eq!(workplace.outputs(), ["report.md", "settings.csv"]);
        let report = read(&workplace, "report.md");
        assert_eq!(verdicts(&report, id).len(), claims, "{report}");
        assert_table(&read(&workplace, "settings.csv"), settings);
    }
}

/// A figure of methods beside the walk, whose claims are these.
fn beside_the_walk(name: &str, claims: &[&str]) -> String {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    figure(&workplace, &cache, &[name, "--frames", "1"]).done();
    assert_eq!(workplace.outputs(), ["images.png", "report.md"]);
    let report = read(&workplace, "report.md");
    for id in claims {
        let found = verdicts(&report, &format!("{id} "));
        assert!(found.len() == 1 && ["yes", "**no**", "undecided"].contains(&found[0].as_str()), "{id}: {report}");
    }
    report
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn profiles_and_what_is_traced_beside_them() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    figure(&workplace, &cache, &["zhang2025-profiles", "--frames", "1"]).done();
    assert_eq!(workplace.outputs(), ["images.png", "profiles.svg", "report.md"]);
    let report = read(&workplace, "report.md");
    for id in ["P1 ", "P2 ", "P3 ", "P4 "] {
        let found = verdicts(&report, id);
        assert!(found.len() == 1 && ["yes", "**no**", "undecided"].contains(&found[0].as_str()), "{id}: {report}");
    }
    // rays do not depend on how much is rendered, and of ours there are more than slides count
    assert_eq!(verdicts(&report, "P5 "), ["**no**"], "{report}");
    let row = report.lines().find(|line| line.starts_with("| statue, skin1:0.02 |"));
    // the errors of three methods, and how much brighter they are
    assert_eq!(row.map(|row| row.matches(" ± ").count()), Some(6), "{report}");
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn cubes_by_scale_and_depth() {
    let claims = ["C0", "C1", "C2", "C3", "C4", "C5", "C6", "C7", "C8", "C9", "C10"];
    let report = beside_the_walk("zhang2025-cubes", &claims);
    // where samples land depends on no picture
    assert_eq!(verdicts(&report, "C0 "), ["yes"], "{report}");
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn thin_and_hollow_places() {
    let report = beside_the_walk("zhang2025-places", &["L1", "L2", "L3", "L4", "L5", "L6"]);
    assert_eq!(report.matches("| skin1:0.02, ").count(), 4, "{report}");
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn candies_candles_and_a_layer() {
    let report = beside_the_walk("zhang2025-candies", &["Y1", "Y2", "Y3", "Y4", "Y5", "Y6"]);
    // what is scattered and what is transmitted are parts of the same paths, and of candles much is lost
    assert_eq!([verdicts(&report, "Y1 "), verdicts(&report, "Y3 ")], [["yes"], ["**no**"]], "{report}");
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn figures_that_cannot_be() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    let refused = |more: &[&str], words: &[&str]| {
        figure(&workplace, &cache, more).refused(words);
        assert_eq!(workplace.outputs(), [""; 0]);
    };
    let all = [
        "kettunen2023-fig3",
        "kettunen2023-fig4",
        "zhang2025-grid",
        "zhang2025-walk",
        "zhang2025-cubes",
        "zhang2025-places",
        "zhang2025-candies",
        "tokuyoshi-fig1",
        "tokuyoshi-fig2",
        "bitterli2020-fig1",
    ];
    refused(&["bitterli2020-fig2"], &[&["bitterli2020-fig2"], all.as_slice()].concat());
    refused(&["bitterli2020-fig1", "--restarts", "3"], &["--restarts 3", "4 to"]);
    refused(&["bitterli2020-fig1", "--frames", "1"], &["--frames 1", "2 to"]);
    refused(&["tokuyoshi-fig1", "--frames", "17"], &["--frames 17", "18 to"]);
    refused(&["tokuyoshi-fig2", "--restarts", "5"], &["--restarts 5", "even"]);
    refused(&["tokuyoshi-fig2", "--reference-spp", "0"], &["--reference-spp"]);
    for option in ["--reference-spp", "--reference-seconds"] {
        refused(&["tokuyoshi-fig1", option, "64"], &[option, "none", "leave"]);
    }
    refused(&["bitterli2020-fig1", "--env", "missing.exr"], &["cannot read", "missing.exr"]);
    let sky = workplace.output("../sky.exr");
    write_exr(sky.as_ref(), &Image { width: 2, height: 1, pixels: vec![[1.0; 3]; 2] }, &[]).unwrap();
    refused(&["tokuyoshi-fig1", "--env", &sky], &["--env", "leave it out"]);
    for figure in ["bitterli2020-fig1", "tokuyoshi-fig1", "tokuyoshi-fig2"] {
        for size in ["0x9", "1x1", "11x12", "12x11", "16385x12"] {
            let no_size = ["figure", figure, "--size", size, "--out", &workplace.output("")];
            run(no_size).refused(&[size, "sides from 12 to 16384"]);
        }
    }
    run(["figure", "tokuyoshi-fig1"]).refused(&["--out"]);
    let file = workplace.input("file", b"");
    let no_folder = ["figure", "tokuyoshi-fig1", "--size", "16x12", "--device", "cpu", "--out", &file];
    run(no_folder).refused(&["cannot write", "--out"]);
}
