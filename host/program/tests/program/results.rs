//! What the program gives when all is well.

use std::path::Path;

use restir::image::{Image, read_exr, read_exr_metadata, write_exr};
use restir::scene::Scene;
use serde_json::json;

use crate::support::{TRIANGLE, Workplace, changed, finish, program, run, triangles, value_of};

/// The comparison says that the outputs have the same bits.
fn assert_identical(workplace: &Workplace, outputs: [&str; 2]) {
    let [a, b] = outputs.map(|name| workplace.output(name));
    let stdout = run(["compare", &a, &b]).done().stdout;
    assert!(stdout.lines().any(|line| line.starts_with("identical") && line.ends_with("yes")), "{stdout}");
}

fn write(workplace: &Workplace, name: &str, pixels: &[[f32; 3]]) -> String {
    let path = workplace.output(name);
    let image = Image { width: pixels.len() as u32, height: 1, pixels: pixels.to_vec() };
    write_exr(Path::new(&path), &image, &[]).unwrap();
    path
}

#[test]
fn the_scenes_are_listed() {
    let names = run(["scenes", "--names"]).stdout;
    let expected: Vec<&str> = restir::scene::builtin::NAMES.iter().map(|(name, _)| *name).collect();
    assert_eq!(names.lines().collect::<Vec<_>>(), expected);
    // the last line lists the media
    assert_eq!(run(["scenes"]).stdout.lines().count(), expected.len() + restir::scene::builtin::FAMILIES.len() + 1);
    for name in names.lines().chain(["hall-1"]) {
        run(["info", name]).done();
    }
}

#[test]
fn a_render_writes_its_files_and_how_it_was_made() {
    let workplace = Workplace::new();
    let (exr, png) = (workplace.output("image.exr"), workplace.output("image.png"));
    let more = ["--png", &png, "--spp", "3", "--seed", "7", "--set", "roulette=on"];
    finish(&mut workplace.render("image.exr", "cornell", &more)).says(&["samples/s", &exr, &png]);
    assert_eq!(workplace.outputs(), ["image.exr", "image.png"]);
    let image = read_exr(Path::new(&exr)).unwrap();
    assert_eq!((image.width, image.height), (16, 12));
    assert!(image.pixels.as_flattened().iter().sum::<f32>() > 0.0);
    let metadata = read_exr_metadata(Path::new(&exr)).unwrap();
    let value = |key: &str| value_of(&metadata, key);
    for (key, expected) in [
        ("scene", "cornell"),
        ("technique", "path"),
        ("samples", "3"),
        ("seed", "7"),
        ("max_depth", "8"),
        ("roulette", "on"),
        ("jitter", "on"),
        ("multiscatter", "on"),
        ("executor", "cpu"),
        ("flavour", "exact"),
        ("parity", "exact"),
        ("dropped_samples", "0"),
    ] {
        assert_eq!(value(key), Some(expected), "{key}");
    }
    assert!(value("commit").is_some() && value("version").is_some() && value("dispatches").is_some());
}

/// Without a technique the settings of all are listed: each name with what it does, and each setting with its default.
#[test]
fn settings_are_listed() {
    let all = run(["settings"]).done().stdout;
    for technique in restir::technique::all() {
        let about = technique.about();
        assert!(all.lines().any(|line| line == format!("{}: {}", about.name, about.summary)), "{all}");
        let alone = run(["settings", about.name]).done().stdout;
        assert!(all.contains(&alone), "{all}");
        for entry in technique.entries() {
            let pair = format!("{}={} ", entry.key, entry.value);
            assert!(alone.lines().any(|line| line.starts_with(&pair)), "{pair} is not in:\n{alone}");
        }
    }
}

/// The sum over a PNG's bytes.
fn brightness(path: &str) -> u64 {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    bytes.into_iter().map(u64::from).sum()
}

#[test]
fn exposure_and_tone_mapping_change_the_png_alone() {
    let workplace = Workplace::new();
    let png = workplace.output("image.png");
    let mut pictures = Vec::new();
    let mut shown = |more: &[&str]| {
        let options = [&["--spp", "1", "--png", png.as_str()], more].concat();
        pictures.push(workplace.picture("image.exr", "cornell", &options));
        brightness(&png)
    };
    let plain = shown(&[]);
    let [brighter, darker] = ["1", "-1.5"].map(|stops| shown(&["--exposure", stops]));
    assert!(darker < plain && plain < brighter, "{darker} {plain} {brighter}");
    let mapped = ["reinhard", "aces", "neutral"].map(|operator| shown(&["--tonemap", operator]));
    let all: std::collections::BTreeSet<u64> = mapped.into_iter().chain([plain]).collect();
    assert_eq!(all.len(), 4, "an operator does nothing");
    assert!(pictures.iter().all(|picture| *picture == pictures[0]), "the EXR file changed");
}

/// The built-in scene's own camera, given by hand, shows the same; another one does not.
#[test]
fn a_camera_can_be_given() {
    let workplace = Workplace::new();
    let camera = Scene::load("cornell").unwrap().camera.unwrap();
    let point = |p: [f64; 3]| p.map(|x| x.to_string()).join(",");
    let [eye, target] = [camera.position, camera.target].map(|p| point(p.to_array()));
    let fov = camera.vertical_fov.to_degrees();
    let seen = |camera: &[&str]| workplace.picture("image.exr", "cornell", &[&["--spp", "1"], camera].concat());
    let own = seen(&[]);
    let given = seen(&["--camera", &format!("{eye}:{target}:{fov}")]);
    assert_eq!(own, given);
    assert!(own != seen(&["--camera", &format!("{eye}:{target}:20")]));
}

#[test]
fn bodies_can_be_filled() {
    let workplace = Workplace::new();
    let seen = |more: &[&str]| {
        let common = ["--spp", "2", "--size", "24x32", "--max-depth", "4"];
        workplace.picture("image.exr", "statue", &[common.as_slice(), more].concat())
    };
    let (own, marble) = (seen(&[]), seen(&["--subsurface", "marble:0.02"]));
    assert!(own != marble);
    assert!(marble != seen(&["--subsurface", "marble:0.002"]) && marble != seen(&["--subsurface", "skin1:0.02"]));
    assert!(marble != seen(&["--subsurface", "marble:0.02", "--set", "orders=1..3"]));
    assert!(marble != seen(&["--subsurface", "0.93,0.91,0.88:0.02"]));
    let none = workplace.output("none.exr");
    for (scene, given, known) in [
        ("statue", "granite", "marble"),
        ("statue", "wax:0", "wax:"),
        ("statue", "0.2,0.3", "three numbers"),
        ("statue", "wax:thick", "MEDIUM:SCALE"),
        ("furnace", "wax", "closed"),
    ] {
        run(["render", scene, "-o", &none, "--subsurface", given]).refused(&[known]);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_standard_output_does_not_lose_the_files() {
    let workplace = Workplace::new();
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let mut command = workplace.render("image.exr", "cornell", &["--spp", "1"]);
    let status = command.stdout(full).stderr(std::process::Stdio::null()).status().unwrap();
    assert_eq!(status.code(), Some(2));
    assert_eq!(workplace.outputs(), ["image.exr"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_scene_whose_path_is_not_utf8() {
    use std::os::unix::ffi::OsStrExt;
    let workplace = Workplace::new();
    let scene = workplace.scene(&triangles(&TRIANGLE));
    let renamed = Path::new(&scene).with_file_name(std::ffi::OsStr::from_bytes(b"sc\xffne.glb"));
    std::fs::rename(&scene, &renamed).unwrap();
    run(["info".as_ref(), renamed.as_os_str()]).done();
}

#[test]
fn equal_renders_give_equal_files() {
    let workplace = Workplace::new();
    let file = |name: &str, more: &[&str]| {
        workplace.picture(name, "cornell", &[&["--spp", "5", "--jitter"], more].concat());
        std::fs::read(workplace.output(name)).unwrap()
    };
    assert_eq!(file("one.exr", &["--threads", "1"]), file("three.exr", &["--threads", "3"]));
    assert_ne!(file("one.exr", &[]), file("other.exr", &["--seed", "1"]));
}

#[test]
fn the_split_into_dispatches_does_not_change_the_image() {
    let workplace = Workplace::new();
    workplace.picture("whole.exr", "cornell", &["--spp", "13"]);
    workplace.picture("split.exr", "cornell", &["--spp", "13", "--set", "dispatch_samples=2"]);
    assert_identical(&workplace, ["split.exr", "whole.exr"]);
}

#[test]
fn the_furnace_has_its_radiance() {
    let image = Workplace::new().picture("furnace.exr", "furnace", &["--spp", "256", "--max-depth", "4"]);
    // The channels of a pixel are one estimate: the furnace is grey.
    let estimates: Vec<f64> = image.pixels.iter().map(|&[x, ..]| f64::from(x)).collect();
    let count = estimates.len() as f64;
    let mean = estimates.iter().sum::<f64>() / count;
    let variance = estimates.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
    let standard_error = (variance / count).sqrt();
    assert!(standard_error < 0.02 && (mean - 1.875).abs() < 4.0 * standard_error + 1e-5, "{mean} +- {standard_error}");
}

#[test]
fn a_text_file_with_its_buffer_beside_it() {
    let workplace = Workplace::new();
    let (document, bytes) = changed(|d| {
        d["buffers"][0]["uri"] = json!("the%20buffer.bin");
        d["materials"][0]["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    });
    workplace.input("the buffer.bin", &bytes);
    let scene = workplace.input("scene.gltf", document.to_string().as_bytes());
    let pixels = workplace.picture("image.exr", &scene, &["--spp", "1"]).pixels;
    assert!(pixels.contains(&[1.0; 3]) && pixels.contains(&[0.0; 3]));
}

#[test]
fn only_the_front_of_an_emitter_is_bright() {
    let workplace = Workplace::new();
    let sees_light = |scale: [i32; 3], rotation: [i32; 4]| {
        let scene = changed(|d| {
            d["materials"][0]["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
            d["nodes"] = json!([{ "mesh": 0, "scale": scale, "rotation": rotation }]);
        });
        workplace.picture("image.exr", &workplace.scene(&scene), &["--spp", "1"]).pixels.contains(&[1.0; 3])
    };
    let (none, half_turn) = ([0, 0, 0, 1], [0, 1, 0, 0]);
    assert!(sees_light([1, 1, 1], none) && sees_light([-1, 1, 1], none) && !sees_light([1, 1, -1], none));
    assert!(!sees_light([1, 1, 1], half_turn) && sees_light([1, 1, -1], half_turn));
}

#[test]
fn a_comparison_in_json_has_the_agreed_keys() {
    let workplace = Workplace::new();
    let grey = write(&workplace, "grey.exr", &[[0.5; 3]; 2]);
    let black = write(&workplace, "black.exr", &[[0.0; 3]; 2]);
    let compared = |a, b| run(["compare", a, b, "--json"]).json();
    let same = compared(&grey, &grey);
    let mut keys: Vec<&str> = same.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    let expected =
        ["differing_words", "identical", "max_ulp", "mean_ratio", "rel_mse", "rmae", "rmse", "rmspe", "smape"];
    assert_eq!(keys, expected);
    assert_eq!((&same["identical"], &same["mean_ratio"]), (&json!(true), &json!(1.0)));
    let other = compared(&grey, &black);
    assert_eq!((&other["identical"], &other["differing_words"]), (&json!(false), &json!(6)));
    assert_eq!(other["rmse"], json!(0.5));
    assert!(["mean_ratio", "rmae", "rmspe"].iter().all(|&infinite| other[infinite].is_null()), "{other}");
}

#[test]
fn images_of_different_sizes_are_refused() {
    let workplace = Workplace::new();
    let [one, two] = [1, 2].map(|width| write(&workplace, &format!("{width}.exr"), &vec![[0.0; 3]; width]));
    run(["compare", &one, &two]).refused(&["different sizes", "1 x 1", "2 x 1"]);
}

#[test]
fn layers_show_the_reservoirs_and_leave_the_image_as_it_is() {
    let workplace = Workplace::new();
    let common = ["--technique", "restir-di", "--frames", "5"];
    let plain = workplace.picture("plain.exr", "moving", &common);
    assert_eq!(plain, workplace.picture("layered.exr", "moving", &[&common[..], &["--layers"]].concat()));
    assert_identical(&workplace, ["plain.exr", "layered.exr"]);
    let channels = |name: &str| {
        let image = exr::prelude::read_first_flat_layer_from_file(workplace.output(name)).unwrap();
        let list = image.layer_data.channel_data.list;
        list.iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect::<Vec<(_, Vec<_>)>>()
    };
    assert_eq!(channels("plain.exr").len(), 3);
    let layers = channels("layered.exr");
    let names: Vec<&str> = layers.iter().map(|(name, _)| name.as_str()).collect();
    let expected = ["M", "W", "age", "light", "visibility"].map(|name| format!("reservoir.{name}"));
    assert_eq!(names, [&["B", "G", "R"].map(str::to_owned)[..], &expected].concat());
    let [confidence, weight, age, light, visibility] = [3, 4, 5, 6, 7].map(|i: usize| &layers[i].1);
    for pixel in 0..16 * 12 {
        let has_sample = light[pixel] >= 0.0;
        assert_eq!(age[pixel] >= 0.0, has_sample);
        assert!([confidence[pixel], light[pixel], age[pixel]].iter().all(|&whole| f64::from(whole).fract() == 0.0));
        assert!(age[pixel] < 5.0);
        assert!((0.0..=1.0).contains(&visibility[pixel]));
        assert!(has_sample || weight[pixel] == 0.0);
    }
    assert!(age.iter().any(|&age| age > 0.0) && weight.iter().any(|&weight| weight > 0.0));
    finish(&mut workplace.render("path.exr", "cornell", &["--layers"])).refused(&["--layers"]);
}

/// Errors of what is no picture are no numbers, which a script has to see.
#[test]
fn pixels_that_are_not_finite_are_told() {
    let workplace = Workplace::new();
    let [good, bad] = ["good.exr", "bad.exr"].map(|name| workplace.output(name));
    let mut image = workplace.picture("good.exr", "cornell", &["--spp", "1"]);
    image.pixels[16 * 3 + 2][1] = f32::NAN;
    image.pixels[16 * 7][0] = f32::INFINITY;
    write_exr(bad.as_ref(), &image, &[]).unwrap();
    for (arguments, words) in [([&bad, &good], "bad.exr has 2 pixels"), ([&good, &bad], "bad.exr has 2 pixels")] {
        let outcome = finish(&mut program(["compare", arguments[0], arguments[1], "--json"]));
        assert_eq!(outcome.code, Some(1), "{}", outcome.stderr);
        assert!(outcome.stdout.contains(r#""rmse":null"#), "{}", outcome.stdout);
        assert!(outcome.stderr.contains(words) && outcome.stderr.contains("the first at 2,3"), "{}", outcome.stderr);
    }
    finish(&mut program(["compare", &good, &good])).done();
}
