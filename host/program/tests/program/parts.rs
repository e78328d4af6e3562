//! Parts of an image, and what they are merged to.

use std::path::Path;

use restir::image::{Image, read_exr, read_exr_metadata};

use crate::support::{Workplace, finish, program, value_of};

impl Workplace {
    /// Renders a part.
    fn part(&self, name: &str, more: &[&str]) -> String {
        finish(&mut self.render(name, "cornell", more)).done();
        self.output(name)
    }

    fn merged(&self, parts: &[&str]) -> Image {
        let output = self.output("merged.exr");
        finish(program(["merge", "-o", &output]).args(parts)).done();
        read_exr(Path::new(&output)).unwrap()
    }

    fn does_not_merge(&self, parts: &[&str], words: &[&str]) {
        let output = self.output("merged.exr");
        finish(program(["merge", "-o", &output]).args(parts)).refused(words);
        assert!(!Path::new(&output).exists());
    }
}

#[test]
fn parts_are_merged_to_the_bits_of_one_render() {
    let workplace = Workplace::new();
    let a = workplace.part("a.part", &["--spp", "7", "--samples", "0..4"]);
    let b = workplace.part("b.part", &["--spp", "7", "--samples", "5..6", "--tile", "10x12+0+0"]);
    let c = workplace.part("c.part", &["--samples", "5..6", "--tiles", "6x12+10+0"]);
    let whole = workplace.picture("whole.exr", "cornell", &["--spp", "7"]);
    assert_eq!(workplace.merged(&[&c, &a, &b]), whole);
    let metadata = read_exr_metadata(Path::new(&workplace.output("merged.exr"))).unwrap();
    let of_whole = read_exr_metadata(Path::new(&workplace.output("whole.exr"))).unwrap();
    for key in ["samples", "seed", "technique", "max_depth", "scene", "executor", "dropped_samples"] {
        assert_eq!(value_of(&metadata, key), value_of(&of_whole, key), "{key}");
    }
    assert_eq!(value_of(&metadata, "merged_parts"), Some("3"));
    finish(&mut program(["info", &b])).says(&["--samples 5..6", "--tile 10x12+0+0", "16 x 12 pixels"]);
}

/// The sentence names the files and what to do.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn parts_that_do_not_go_together_are_refused() {
    let workplace = Workplace::new();
    let a = workplace.part("a.part", &["--spp", "8", "--samples", "0..3"]);
    let b = workplace.part("b.part", &["--spp", "8", "--samples", "4..7"]);
    workplace.does_not_merge(&[&a], &["samples are missing", "--samples 4..7"]);
    workplace.does_not_merge(&[&b], &["samples are missing", "--samples 0..3"]);
    workplace.does_not_merge(&[&a, &b, &a], &["a.part", "it is given twice"]);
    let copy = workplace.input("copy.part", &std::fs::read(&a).unwrap());
    workplace.does_not_merge(&[&a, &b, &copy], &["copy.part", "--samples 0..3", "leave one of them out"]);
    let overlap = workplace.part("overlap.part", &["--samples", "2..5"]);
    workplace.does_not_merge(&[&a, &overlap], &["overlap.part", "a.part has --samples 2..3, too"]);
    let tile = workplace.part("tile.part", &["--samples", "4..7", "--tile", "16x5+0+0"]);
    workplace.does_not_merge(&[&a, &tile], &["--samples 4..7 --tile 16x7+0+5"]);
    for (settings, problem) in [
        (&["--seed", "1"][..], "it is of seed=1, and"),
        (&["--size", "12x16"], "it is of width=12"),
        (&["--max-depth", "3"], "it is of max_depth=3"),
        (&["--no-jitter"], "it is of jitter=off"),
        (&["--set", "roulette=on"], "it is of roulette=on"),
        (&["--camera", "278,273,-700:278,273,0"], "it is of another camera than"),
        (&["--default-light"], "it is of another scene than"),
    ] {
        let other = workplace.part("other.part", &[&["--samples", "4..7"][..], settings].concat());
        workplace.does_not_merge(&[&a, &other], &["other.part", problem, "a.part", "merge parts of one render"]);
    }
    let chain = workplace.part("chain.part", &["--technique", "restir-di", "--frames", "2", "--chains", "4..5"]);
    workplace.does_not_merge(&[&a, &chain], &["chain.part: it has chains, and", "has samples"]);
    let cut = workplace.input("cut.part", &std::fs::read(&b).unwrap()[..2000]);
    workplace.does_not_merge(&[&a, &cut], &["cut.part", "no whole part of an image", "render it again"]);
    let image = workplace.output("image.exr");
    workplace.picture("image.exr", "cornell", &["--spp", "1"]);
    workplace.does_not_merge(&[&a, &image], &["image.exr", "it is no part of an image"]);
    workplace.does_not_merge(&[&a, "missing.part"], &["missing.part"]);
    finish(&mut program(["merge", &a, &b, "-o", &a])).refused(&[".exr"]);
}

#[test]
fn what_has_no_parts_is_refused() {
    let workplace = Workplace::new();
    let di = ["--technique", "restir-di"];
    for (name, more, words) in [
        ("a.exr", &["--samples", "0..3"][..], &["-o FILE.part"][..]),
        ("a.part", &["--spp", "3"], &["say which by --samples A..B"]),
        ("a.part", &["--samples", "0..3", "--png", "a.png"], &["--png is for whole images"]),
        ("a.part", &["--samples", "0..3", "--denoise"], &["--denoise is for whole images"]),
        ("a.part", &["--samples", "0..3", "--aov", "depth"], &["--aov is for whole images"]),
        ("a.part", &["--samples", "0..3", "--resume", "state"], &["--resume keeps the state of a chain"]),
        ("a.part", &["--samples", "0..8", "--spp", "8"], &["ends with sample 8", "the image has 8"]),
        ("a.part", &["--tile", "4x4+13+0"], &["4x4+13+0 is not in the image of 16 x 12 pixels"]),
        ("a.part", &["--tile", "0x4+1+0"], &["0x4+1+0 is not in the image"]),
        ("a.part", &["--chains", "0..3"], &["path has no parts by chains"]),
        ("a.part", &["--samples", "3..1"], &["A..B"]),
        ("a.part", &[&di[..], &["--samples", "0..3"]].concat(), &["restir-di has no parts by samples"]),
        ("a.part", &[&di[..], &["--tile", "4x4+0+0"]].concat(), &["restir-di has no tiles"]),
        ("a.part", &[&di[..], &["--chains", "0..3", "--tile", "4x4+0+0"]].concat(), &["use samples of each other"]),
        ("a.part", &[&di[..], &["--chains", "0..3", "--frames", "2..4"]].concat(), &["--frames COUNT"]),
        (
            "a.part",
            &[&di[..], &["--frames", "0..3", "--accumulate", "--camera-path", "orbit"]].concat(),
            &["no common mean"],
        ),
    ] {
        workplace.refuses(&mut workplace.render(name, "cornell", more), words);
    }
}

/// The state of a chain goes from part to part in a file; without it the chain begins at frame 0.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn frames_go_on_from_the_state_of_those_before() {
    let workplace = Workplace::new();
    let state = workplace.input("state", &[]);
    std::fs::remove_file(&state).unwrap();
    let di = ["--technique", "restir-di", "--accumulate"];
    let part = |name: &str, frames: &str, more: &[&str]| {
        let outcome =
            finish(&mut workplace.render(name, "cornell", &[&di[..], &["--frames", frames], more].concat())).done();
        (workplace.output(name), outcome.stderr.contains("from 0 on had to be rendered, too"))
    };
    let (a, _) = part("a.part", "0..4", &["--resume", &state]);
    let (b, from_zero) = part("b.part", "5..8", &["--resume", &state]);
    assert!(!from_zero);
    let (again, from_zero) = part("again.part", "5..8", &[]);
    assert!(from_zero, "it is said that frames 0 to 4 are rendered, too");
    let whole = workplace.picture("whole.exr", "cornell", &[&di[..], &["--frames", "9"]].concat());
    assert_eq!(workplace.merged(&[&a, &b]), whole);
    assert_eq!(workplace.merged(&[&again, &a]), whole);
    // the state is after frame 8 now
    let mut late =
        workplace.render("late.part", "cornell", &[&di[..], &["--frames", "3..4", "--resume", &state]].concat());
    finish(&mut late).refused(&["the state before frame 9, and frame 3 is asked for"]);
    let other = [&di[..], &["--frames", "9..9", "--seed", "1", "--resume", &state]].concat();
    finish(&mut workplace.render("other.part", "cornell", &other)).refused(&["of another scene, of other settings"]);
}

/// The same of frames in files of their own, of a scene that moves and a camera that does.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn numbered_frames_go_on_from_the_state_of_those_before() {
    let workplace = Workplace::new();
    let state = workplace.input("state", &[]);
    std::fs::remove_file(&state).unwrap();
    let common = ["--technique", "restir-di", "--camera-path", "orbit", "--frames"];
    let mut passes = Vec::new();
    for (name, frames, resume) in [("a", "0..2", true), ("a", "3..5", true), ("b", "3..5", false)] {
        let resume = if resume { vec!["--resume", &state] } else { Vec::new() };
        let more = [&common[..], &[frames], &resume].concat();
        let outcome = finish(&mut workplace.render(&format!("{name}.##.exr"), "moving", &more)).done();
        passes.push(outcome.stdout.lines().count());
    }
    assert_eq!(passes, [4, 4, 4]);
    let picture = |name: &str| read_exr(Path::new(&workplace.output(name))).unwrap();
    for frame in 3..=5 {
        assert_eq!(picture(&format!("a.0{frame}.exr")), picture(&format!("b.0{frame}.exr")), "frame {frame}");
    }
    let path = ["--frames", "0..2", "--resume", &state];
    finish(&mut workplace.render("c.##.exr", "moving", &path)).refused(&["--skip-existing"]);
}

/// Frames of path tracing have parts, too, each in a file of its own.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn frames_in_parts_are_those_of_whole_renders() {
    let workplace = Workplace::new();
    let frames = ["--frames", "1..2", "--spp", "3"];
    for (name, samples) in [("a.##.part", "0..0"), ("b.##.part", "1..2")] {
        finish(&mut workplace.render(name, "moving", &[&frames[..], &["--samples", samples]].concat())).done();
    }
    finish(&mut workplace.render("whole.##.exr", "moving", &frames)).done();
    for frame in ["01", "02"] {
        let parts = ["a", "b"].map(|name| workplace.output(&format!("{name}.{frame}.part")));
        let whole = read_exr(Path::new(&workplace.output(&format!("whole.{frame}.exr")))).unwrap();
        assert_eq!(workplace.merged(&parts.each_ref().map(String::as_str)), whole);
        std::fs::remove_file(workplace.output("merged.exr")).unwrap();
    }
    let mixed = [workplace.output("a.01.part"), workplace.output("b.02.part")];
    workplace.does_not_merge(&mixed.each_ref().map(String::as_str), &["b.02.part", "of another scene"]);
}

/// What is still wanted are ranges that can be asked for, and with them it is enough.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn ranges_are_listed_until_the_noise_is_low_enough() {
    let workplace = Workplace::new();
    let mut parts: Vec<String> =
        ["0..7", "8..15"].map(|range| workplace.part(&format!("{range}.part"), &["--samples", range])).into();
    let mut goal = None;
    for round in 0..6 {
        let output = workplace.output("merged.exr");
        let goal_now = goal.map_or_else(|| "1".to_owned(), |goal: f64| goal.to_string());
        let mut command = program(["merge", "-o", &output, "--more-until-noise", &goal_now]);
        let said = finish(command.args(&parts)).done().stdout;
        let noise = said.lines().find_map(|line| line.strip_prefix("noise ")).unwrap();
        let noise: f64 = noise.split(' ').next().unwrap().parse().unwrap();
        let wanted: Vec<&str> = said.lines().filter_map(|line| line.strip_prefix("--samples ")).collect();
        match goal {
            None => goal = Some(noise / 2.0),
            Some(goal) if noise <= goal => {
                assert!(wanted.is_empty() && round > 1, "{said}");
                return;
            }
            Some(_) => assert!(!wanted.is_empty(), "{said}"),
        }
        parts.extend(wanted.iter().map(|range| workplace.part(&format!("{range}.part"), &["--samples", range])));
    }
    panic!("the noise is not halved by the ranges that were asked for");
}
