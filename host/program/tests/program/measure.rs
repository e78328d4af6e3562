//! `restir reference` and `restir explain`.

use std::path::Path;

use restir::image::read_exr;
use serde_json::Value;
use tempfile::TempDir;

use crate::support::{Outcome, Workplace, finish, program, run, with_defaults};

const SMALL: [[&str; 2]; 2] = [["--size", "8x8"], ["--max-depth", "4"]];

fn reference(cache: &Path, more: &[&str]) -> Outcome {
    let mut command = program(["reference", "furnace", "--device", "cpu", "--cache"]);
    command.arg(cache);
    finish(&mut with_defaults(command, &[&[["--spp", "512"]], &SMALL[..]].concat(), more))
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn a_reference_is_written_with_its_error_and_kept() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    let (output, error) = (workplace.output("r.exr"), workplace.output("e.exr"));
    let made = reference(cache.path(), &["-o", &output, "--error", &error]).done();
    let mean = |path: &str| {
        let image = read_exr(Path::new(path)).unwrap();
        assert_eq!((image.width, image.height), (8, 8));
        let values = image.pixels.as_flattened();
        values.iter().map(|&x| f64::from(x)).sum::<f64>() / values.len() as f64
    };
    assert!((mean(&output) - 1.875).abs() < 0.02 && mean(&error) > 0.0 && mean(&error) < 0.1);
    let kept = reference(cache.path(), &[]);
    let wrote = format!("{}wrote {output}\nwrote {error}\n", kept.stdout);
    assert_eq!(made.stdout, wrote, "the files are named, and nothing was rendered anew");
    reference(cache.path(), &["--spp", "640"]).says(&["640 per pixel"]);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn references_that_cannot_be() {
    let (workplace, cache) = (Workplace::new(), TempDir::new().unwrap());
    let refused = |more: &[&str], words: &[&str]| {
        reference(cache.path(), more).refused(words);
    };
    refused(&["--spp", "0"], &["0 samples"]);
    refused(&["--max-depth", "0"], &["depth"]);
    refused(&["-o", &workplace.output("missing/r.exr")], &["cannot write", "missing"]);
    reference(workplace.input("file", b"").as_ref(), &[]).refused(&["cannot write", "--cache"]);
    run(["reference", "teapot"]).refused(&["teapot"]);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn an_explained_sample_is_the_pixel_of_a_render() {
    let common = ["--size", "16x12", "--seed", "7", "--jitter", "--device", "cpu"];
    let image = Workplace::new().picture("image.exr", "cornell", &[&common[..], &["--spp", "1"]].concat());
    for (x, y) in [(0, 0), (7, 1), (8, 6), (15, 11)] {
        let pixel = format!("{x},{y}");
        let arguments = ["explain", "cornell", "--pixel", &pixel, "--json"];
        let object = run(arguments.iter().chain(&common)).json();
        let radiance: Vec<f32> =
            object["radiance"].as_array().unwrap().iter().map(|value| value.as_f64().unwrap() as f32).collect();
        let expected = image.pixels[y * 16 + x];
        assert_eq!(radiance.iter().map(|x| x.to_bits()).collect::<Vec<_>>(), expected.map(f32::to_bits));
        assert_eq!((&object["film_identical"], &object["sum_identical"]), (&Value::Bool(true), &Value::Bool(true)));
        // the corners look past the box
        let hits = object["vertices"].as_array().unwrap().len();
        assert!(hits > 0 || (expected == [0.0; 3] && !object["escape"].is_null()), "{object}");
    }
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn an_explanation_can_be_read() {
    let outcome = run(["explain", "furnace", "--pixel", "3,4", "--sample", "5", "--size", "8x8", "--device", "cpu"]);
    let words = ["pixel (3, 4), sample 5", "8. along", "walls", "emits", "light from triangle", "per steradian"];
    let outcome = outcome.says(&words);
    assert_eq!(outcome.stdout.matches("the same bits").count(), 2, "{}", outcome.stdout);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn explanations_that_cannot_be() {
    let refused = |more: &[&str], words: &[&str]| {
        let common = ["explain", "furnace", "--size", "8x8", "--device", "cpu"];
        let outcome = run(common.iter().chain(more)).refused(words);
        assert!(!outcome.stderr.contains("device:"), "arguments are judged first:\n{}", outcome.stderr);
    };
    for technique in ["path", "restir-di"] {
        let refused = |more: &[&str], words: &[&str]| refused(&[&["--technique", technique], more].concat(), words);
        refused(&["--pixel", "8,0"], &["(8, 0)", "8 x 8"]);
        refused(&["--pixel", "1,1", "--jitter", "--set", "jitter=off"], &["--jitter", "jitter=off", "leave"]);
    }
    let reservoir = ["--pixel", "1,1", "--technique", "restir-di"];
    refused(&[&reservoir[..], &["--max-depth", "8"]].concat(), &["2 segments", "--max-depth"]);
    refused(&[&reservoir[..], &["--frames", "0"]].concat(), &["0 frames"]);
    refused(&["--pixel", "-1,0"], &["--pixel", "natural number"]);
    refused(&["--pixel", "1"], &["--pixel", "X,Y"]);
    refused(&[], &["--pixel"]);
    refused(&["--pixel", "1,1", "--set", "rolette=on"], &["roulette"]);
    refused(&["--pixel", "1,1", "--sample", "x"], &["--sample"]);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn a_reservoir_has_a_genealogy() {
    let explained = |pixel: &str, more: &str| {
        let common = "explain moving --technique restir-di --size 16x12 --device cpu --pixel";
        run(common.split(' ').chain([pixel]).chain(more.split(' ')))
    };
    let frames = "--frames 4 --camera-path orbit --set spatial=2";
    let words =
        ["frame 3, spatial reuse 2, pixel (8, 6): M ", "light ", " at u ", "initial candidates", "the same bits"];
    explained("8,6", frames).says(&words);
    let object = explained("8,6", &format!("{frames} --json")).json();
    assert_eq!(object["identical"], Value::Bool(true));
    let reservoirs = object["reservoirs"].as_array().unwrap();
    let (first, last) = (&reservoirs[0], &reservoirs[reservoirs.len() - 1]);
    assert_eq!((&first["frame"], &first["pass"]), (&Value::from(3), &Value::from("spatial reuse 2")));
    assert_eq!(last["pass"], Value::from("initial candidates"));
    assert!(last["from"]["candidate"].is_u64(), "{last}");
    assert_eq!(object["age"].as_u64().unwrap(), 3 - last["frame"].as_u64().unwrap());
    explained("8,6", "--sample 1").refused(&["--sample", "restir-di"]);
    explained("8,6", "--frames 0").refused(&["0 frames"]);
    explained("8,6", "--frames 4000000000").refused(&["memory"]);
    explained("16,6", "--frames 4").refused(&["(16, 6)", "16 x 12"]);
    run(["explain", "furnace", "--pixel", "0,0", "--frames", "2"]).refused(&["--frames", "restir-di"]);
}

/// Advice for a small picture of the Cornell box.
fn advise(more: &[&str]) -> Outcome {
    let defaults = [["--seconds", "1"], ["--size", "40x30"], ["--frames", "4"], ["--device", "cpu"]];
    finish(&mut with_defaults(program(["advise", "cornell"]), &defaults, more))
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn advice_names_a_command_that_works() {
    let advice = advise(&["--json"]).json();
    let techniques = advice["techniques"].as_array().unwrap();
    let names: Vec<&str> = techniques.iter().map(|row| row["technique"].as_str().unwrap()).collect();
    for name in
        ["path", "restir-di:last,preset=quality", "restir-di:last,preset=offline", "restir-di:preset=progressive"]
    {
        assert!(names.contains(&name), "{names:?}");
    }
    let factors: Vec<f64> = techniques.iter().map(|row| row["at_equal_time"].as_f64().unwrap()).collect();
    assert!(factors[0] == 1.0 && factors.is_sorted(), "{factors:?}");
    assert!(
        techniques.iter().all(|row| row["rel_mse"].as_f64() > Some(0.0) && row["rel_mse_error"].as_f64() > Some(0.0))
    );
    assert!(advice["images"].as_u64() >= Some(4));
    let command = advice["command"].as_str().unwrap();
    let (workplace, words) = (Workplace::new(), command.split(' ').map(str::to_owned).collect::<Vec<_>>());
    assert!(command.starts_with("restir render cornell --size 40x30 --device cpu --technique "), "{command}");
    let image = workplace.output("image.exr");
    let arguments: Vec<&str> = words[1..words.len() - 1].iter().map(String::as_str).chain([image.as_str()]).collect();
    run(arguments).done();
    assert_eq!(workplace.outputs(), ["image.exr"]);
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn advice_is_of_what_was_asked_for() {
    let among = ["--technique", "path", "--technique", "restir-di:last,preset=biased-2020", "--camera-path", "pan"];
    let outcome = advise(&among).done();
    for word in ["path", "restir-di:last,preset=biased-2020", "biased  restir-di", "restir render cornell"] {
        assert!(outcome.stdout.contains(word), "{}", outcome.stdout);
    }
    // without reuse the last view is rendered, with it all of them
    let command = outcome.stdout.lines().last().unwrap();
    assert!(command.contains(" --camera ") != command.contains(" --camera-path pan"), "{command}");
    advise(&["--seconds", "0"]).refused(&["0 seconds"]);
    advise(&["--frames", "0"]).refused(&["--frames 0"]);
    advise(&["--technique", "restir-di:last,preset=wis"]).refused(&["biased", "add path"]);
    advise(&["--technique", "path", "--technique", "path"]).refused(&["path"]);
    advise(&["--technique", "path:colour=red"]).refused(&["colour"]);
    run(["advise", "teapot"]).refused(&["teapot", "hall-SEED"]);
}
