//! Frames one after another, each in a file of its own.

use std::path::Path;

use restir::advanced::metrics;
use restir::image::{Image, read_exr, read_exr_metadata};
use restir::scene::Scene;

use crate::support::{Workplace, finish, value_of};

/// Renders such frames, and gives the names of all outputs.
fn frames(workplace: &Workplace, scene: &str, more: &[&str]) -> Vec<String> {
    finish(&mut workplace.render("out.###.exr", scene, more)).done();
    workplace.outputs()
}

fn picture(workplace: &Workplace, name: &str) -> Image {
    read_exr(Path::new(&workplace.output(name))).unwrap()
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn a_turntable_is_files_of_all_sides() {
    let workplace = Workplace::new();
    let png = workplace.output("out.##.png");
    let names = frames(&workplace, "statue", &["--spp", "2", "--turntable", "4", "--png", &png]);
    let expected = (0..4).flat_map(|frame| [format!("out.{frame:02}.png"), format!("out.{frame:03}.exr")]);
    assert_eq!(names, {
        let mut all: Vec<String> = expected.collect();
        all.sort();
        all
    });
    let pictures = [0, 1, 2, 3].map(|frame| picture(&workplace, &format!("out.{frame:03}.exr")));
    assert_eq!(pictures[0], workplace.picture("still.exr", "statue", &["--spp", "2"]));
    // one of them alone
    finish(&mut workplace.render("one.#.exr", "statue", &["--spp", "2", "--turntable", "4", "--frames", "2..2"]))
        .done();
    assert_eq!(picture(&workplace, "one.2.exr"), pictures[2]);
    // seen from where a camera is that has gone around by a quarter a frame, and not the other way
    let camera = Scene::load("statue").unwrap().camera.unwrap();
    let away = camera.position - camera.target;
    for (frame, [x, z]) in [(1, [away.z, -away.x]), (2, [-away.x, -away.z]), (3, [-away.z, away.x])] {
        let difference = |[x, z]: [f64; 2]| {
            let t = camera.target;
            let eye = [t.x + x, t.y + away.y, t.z + z].map(|at| at.to_string()).join(",");
            let look = format!("{eye}:{},{},{}:{}", t.x, t.y, t.z, camera.vertical_fov.to_degrees());
            let seed = frame.to_string();
            let still = workplace.picture("still.exr", "statue", &["--spp", "2", "--camera", &look, "--seed", &seed]);
            metrics::compare(&pictures[frame], &still).unwrap().rmae_global
        };
        let same = difference([x, z]);
        assert!(same < 1.0e-3, "frame {frame}: {same}");
        let opposite = if frame == 1 { difference([-x, -z]) } else { 1.0 };
        assert!(opposite > 0.1, "frame {frame}: {opposite}");
    }
}

/// Of a technique that reuses earlier frames, a frame is what a render that ends there shows, whatever is written before.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn a_frame_does_not_depend_on_which_are_asked_for() {
    let workplace = Workplace::new();
    let common = ["--technique", "restir-di", "--camera-path", "orbit", "--frames"];
    let names = frames(&workplace, "moving", &[&common[..], &["2..4"]].concat());
    assert_eq!(names, ["out.002.exr", "out.003.exr", "out.004.exr"]);
    for frame in [2, 4] {
        let count = (frame + 1).to_string();
        let alone = workplace.picture("alone.exr", "moving", &[&common[..], &[&count]].concat());
        assert_eq!(picture(&workplace, &format!("out.00{frame}.exr")), alone, "frame {frame}");
    }
}

/// Path tracing shows what moves where it is in the frame. Positions of a frame are those of the time that it has.
#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn frames_of_path_tracing_are_at_their_times() {
    let workplace = Workplace::new();
    let common = ["--spp", "1", "--no-jitter", "--aov", "position"];
    frames(&workplace, "toys", &[&common[..], &["--frames", "10..12"]].concat());
    let positions = |name: &str| {
        let channels = exr::prelude::read_first_flat_layer_from_file(workplace.output(name)).unwrap();
        let channels = channels.layer_data.channel_data.list;
        let of = channels.into_iter().filter(|channel| channel.name.to_string().starts_with("Position"));
        of.flat_map(|channel| channel.sample_data.values_as_f32().collect::<Vec<_>>()).collect::<Vec<f32>>()
    };
    let time = (12.0_f64 / 24.0).to_string();
    workplace.picture("time.exr", "toys", &[&common[..], &["--time", &time]].concat());
    let [tenth, twelfth, timed] = ["out.010.exr", "out.012.exr", "time.exr"].map(positions);
    let differing = |a: &[f32], b: &[f32]| a.iter().zip(b).filter(|(a, b)| (*a - *b).abs() > 1.0e-3).count();
    assert_eq!(differing(&twelfth, &timed), 0);
    assert!(differing(&tenth, &timed) > 5, "nothing moves");
    assert_eq!(value_of(&read_exr_metadata(workplace.output("out.012.exr").as_ref()).unwrap(), "frame"), Some("12"));
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn frames_that_are_there_are_left_out() {
    for technique in ["path", "restir-di"] {
        let workplace = Workplace::new();
        let common = ["--technique", technique, "--frames", "0..3", "--camera-path", "pan"];
        let names = frames(&workplace, "cornell", &common);
        assert_eq!(names.len(), 4);
        let bytes = |name: &str| std::fs::read(workplace.output(name)).unwrap();
        let whole: Vec<Vec<u8>> = names.iter().map(|name| bytes(name)).collect();
        std::fs::remove_file(workplace.output("out.001.exr")).unwrap();
        let again = [&common[..], &["--skip-existing"]].concat();
        finish(&mut workplace.render("out.###.exr", "cornell", &again)).says(&["rendered 1 frames", "3 were there"]);
        assert!(names.iter().zip(&whole).all(|(name, whole)| bytes(name) == *whole), "{technique}");
        finish(&mut workplace.render("out.###.exr", "cornell", &again)).says(&["rendered 0 frames"]);
        // of another seed
        let other = [&again[..], &["--seed", "9"]].concat();
        let words = ["out.000.exr", "another render", "delete it"];
        finish(&mut workplace.render("out.###.exr", "cornell", &other)).refused(&words);
        let layered = [&again[..], &["--aov", "depth"]].concat();
        finish(&mut workplace.render("out.###.exr", "cornell", &layered)).refused(&words);
    }
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn frames_that_cannot_be_written() {
    let workplace = Workplace::new();
    let refused = |output: &str, more: &[&str], words: &[&str]| {
        workplace.refuses(&mut workplace.render(output, "cornell", more), words);
    };
    refused("out.exr", &["--frames", "0..3"], &["####", "out.####.exr"]);
    refused("out.#.exr", &["--frames", "3..0"], &["A <= B"]);
    refused("out.#.exr", &["--frames", "0..9999999"], &["999999"]);
    refused("out.#.exr", &["--turntable", "0"], &["at least 1"]);
    refused("out.#.exr", &["--turntable", "3", "--camera-path", "pan"], &["--camera-path"]);
    refused("out.#.exr", &["--turntable", "3", "--frames", "1..3"], &["--turntable has fewer frames"]);
    refused("out.#.exr", &["--turntable", "3", "--frames", "3"], &["leave out --frames"]);
    refused("out.#.exr", &["--skip-existing"], &["--frames A..B"]);
    refused("out.#.exr", &["--frames", "0..3", "--seconds", "3"], &["--seconds", "single image"]);
    let png = workplace.output("out.png");
    refused("out.#.exr", &["--frames", "0..3", "--png", &png], &["out.png", "####"]);
    refused("out.exr", &["--camera-path", "orbit"], &["--frames A..B", "####"]);
}
