//! Renders that stop by time or by noise.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use restir::image::read_exr_metadata;
use restir::technique;

use crate::support::{Workplace, finish, value_of};

fn said(workplace: &Workplace, key: &str) -> f64 {
    let metadata = read_exr_metadata(Path::new(&workplace.output("image.exr"))).unwrap();
    value_of(&metadata, key).expect(key).parse().unwrap()
}

/// The image is the mean of as many renders as it says, with seeds of their own, and as good as was asked for.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn noise_is_what_was_asked_for() {
    let workplace = Workplace::new();
    for technique in technique::all() {
        let name = technique.about().name;
        let few = if name == "path" { ["--spp", "4"] } else { ["--frames", "3"] };
        let common = [&["--technique", name][..], &few].concat();
        let image =
            workplace.picture("image.exr", "cornell", &[&common[..], &["--noise", "0.07", "--seed", "5"]].concat());
        let [scrambles, noise] = ["scrambles", "noise"].map(|key| said(&workplace, key));
        assert!(scrambles >= 8.0 && noise <= 0.07, "{name}: {scrambles} {noise}");
        let mut mean = vec![0.0; image.pixels.len() * 3];
        for scramble in 0..scrambles as u32 {
            let seed = (5 + scramble).to_string();
            let one = workplace.picture("one.exr", "cornell", &[&common[..], &["--seed", &seed]].concat());
            let values = one.pixels.as_flattened();
            mean.iter_mut().zip(values).for_each(|(mean, &value)| *mean += f64::from(value) / scrambles);
        }
        let off = |(mean, value): (&f64, &f32)| (mean - f64::from(*value)).abs() > 1.0e-6 * mean.abs();
        assert!(!mean.iter().zip(image.pixels.as_flattened()).any(off), "{name}");
    }
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn time_is_kept() {
    let workplace = Workplace::new();
    let start = Instant::now();
    workplace.picture("image.exr", "cornell", &["--seconds", "1.5", "--size", "64x48"]);
    let seconds = start.elapsed().as_secs_f64();
    assert!((1.5..15.0).contains(&seconds), "{seconds}");
    assert!(said(&workplace, "scrambles") >= 8.0);
    let noise = said(&workplace, "noise");
    assert!(noise > 0.0 && noise < 1.0, "{noise}");
}

/// An error that cannot be reached: the program is interrupted before it has been silent for ten seconds.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
#[cfg(unix)]
fn what_never_ends_says_so() {
    let workplace = Workplace::new();
    let mut render = workplace.render("image.exr", "cornell", &["--size", "4x3", "--spp", "1", "--noise", "1e-300"]);
    let mut child = render.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    lines.find(|line| line == "rendering: 0 %").expect("a first line");
    let start = Instant::now();
    let said = lines.next();
    let silent = start.elapsed();
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(
        said.is_some_and(|line| line.starts_with("rendering: 0 %")) && silent < Duration::from_secs(10),
        "{silent:?}"
    );
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn stops_that_cannot_be() {
    let workplace = Workplace::new();
    let refused = |more: &[&str], words: &[&str]| {
        workplace.refuses(&mut workplace.render("image.exr", "cornell", more), words);
    };
    for value in ["0", "-1", "nan", "inf"] {
        refused(&["--seconds", value], &["--seconds", "out of range"]);
        refused(&["--noise", value], &["--noise", "out of range"]);
    }
    refused(&["--noise", "0.1", "--resume", &workplace.output("part")], &["--resume"]);
    finish(&mut workplace.render("image.exr", "cornell", &["--timeout", "3"])).refused(&["--seconds"]);
}
