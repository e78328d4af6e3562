//! What the program gives when all is well.

use std::path::Path;

use restir::image::{Image, read_exr, read_exr_metadata, write_exr};
use serde_json::{Value, json};

use crate::support::{TRIANGLE, Workplace, assert_done, assert_refused, glb, program, run, triangles};

fn render(scene: &str, output: &str, more: &[&str]) -> String {
    let common = ["render", scene, "-o", output, "--device", "cpu", "--size", "16x12"];
    let outcome = run(common.iter().chain(more));
    assert_done(&outcome);
    outcome.stdout
}

#[test]
fn the_scenes_are_listed() {
    let names = run(["scenes", "--names"]).stdout;
    let expected: Vec<&str> = restir::scene::builtin::NAMES.iter().map(|(name, _)| *name).collect();
    assert_eq!(names.lines().collect::<Vec<_>>(), expected);
    assert_eq!(run(["scenes"]).stdout.lines().count(), expected.len());
    for name in names.lines() {
        assert_done(&run(["info", name]));
    }
}

#[test]
fn a_render_writes_its_files_and_how_it_was_made() {
    let workplace = Workplace::new();
    let (exr, png) = (workplace.output("image.exr"), workplace.output("image.png"));
    let stdout = render("cornell", &exr, &["--png", &png, "--spp", "3", "--seed", "7", "--set", "roulette=on"]);
    assert!(stdout.contains("samples/s") && stdout.contains(&exr) && stdout.contains(&png), "{stdout}");
    assert_eq!(workplace.outputs(), ["image.exr", "image.png"]);
    let image = read_exr(Path::new(&exr)).unwrap();
    assert_eq!((image.width, image.height), (16, 12));
    assert!(image.pixels.as_flattened().iter().sum::<f32>() > 0.0);
    let metadata = read_exr_metadata(Path::new(&exr)).unwrap();
    let value = |key: &str| metadata.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str());
    for (key, expected) in [
        ("scene", "cornell"),
        ("technique", "path"),
        ("samples", "3"),
        ("seed", "7"),
        ("max_depth", "8"),
        ("roulette", "on"),
        ("jitter", "off"),
        ("executor", "cpu"),
        ("flavour", "exact"),
        ("parity", "exact"),
        ("dropped_samples", "0"),
    ] {
        assert_eq!(value(key), Some(expected), "{key}");
    }
    assert!(value("commit").is_some() && value("version").is_some() && value("dispatches").is_some());
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_standard_output_does_not_lose_the_files() {
    let workplace = Workplace::new();
    let output = workplace.output("image.exr");
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let status = program(["render", "cornell", "-o", &output, "--device", "cpu"])
        .args(["--size", "8x8", "--spp", "1"])
        .stdout(full)
        .stderr(std::process::Stdio::null())
        .status()
        .unwrap();
    assert_eq!(status.code(), Some(2));
    assert_eq!(workplace.outputs(), ["image.exr"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_scene_whose_path_is_not_utf8() {
    use std::os::unix::ffi::OsStrExt;
    let workplace = Workplace::new();
    let (document, bytes) = triangles(&TRIANGLE);
    let scene = workplace.input("scene.glb", &glb(&document, &bytes));
    let folder = Path::new(&scene).parent().unwrap();
    let renamed = folder.join(std::ffi::OsStr::from_bytes(b"sc\xffne.glb"));
    std::fs::rename(&scene, &renamed).unwrap();
    assert_done(&run([std::ffi::OsStr::new("info"), renamed.as_os_str()]));
}

#[test]
fn equal_renders_give_equal_files() {
    let workplace = Workplace::new();
    let file = |name: &str, more: &[&str]| {
        let output = workplace.output(name);
        render("cornell", &output, &[&["--spp", "5", "--jitter"], more].concat());
        std::fs::read(output).unwrap()
    };
    assert_eq!(file("one.exr", &["--threads", "1"]), file("three.exr", &["--threads", "3"]));
    assert_ne!(file("one.exr", &[]), file("other.exr", &["--seed", "1"]));
}

#[test]
fn the_split_into_dispatches_does_not_change_the_image() {
    let workplace = Workplace::new();
    let [whole, split] = ["whole.exr", "split.exr"].map(|name| workplace.output(name));
    render("cornell", &whole, &["--spp", "13"]);
    render("cornell", &split, &["--spp", "13", "--set", "dispatch_samples=2"]);
    let outcome = run(["compare", &split, &whole]);
    assert_done(&outcome);
    assert!(outcome.stdout.lines().any(|line| line.starts_with("identical") && line.ends_with("yes")));
}

#[test]
fn the_furnace_has_its_radiance() {
    let workplace = Workplace::new();
    let output = workplace.output("furnace.exr");
    render("furnace", &output, &["--spp", "256", "--max-depth", "4"]);
    let image = read_exr(Path::new(&output)).unwrap();
    let values = image.pixels.as_flattened();
    // The channels of a pixel are one estimate: the furnace is grey.
    let estimates: Vec<f64> = values.iter().step_by(3).map(|&x| f64::from(x)).collect();
    let count = estimates.len() as f64;
    let mean = estimates.iter().sum::<f64>() / count;
    let variance = estimates.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
    let standard_error = (variance / count).sqrt();
    assert!(standard_error < 0.02 && (mean - 1.875).abs() < 4.0 * standard_error + 1e-5, "{mean} +- {standard_error}");
}

#[test]
fn a_text_file_with_its_buffer_beside_it() {
    let workplace = Workplace::new();
    let (mut document, bytes) = triangles(&TRIANGLE);
    workplace.input("the buffer.bin", &bytes);
    document["buffers"][0]["uri"] = json!("the%20buffer.bin");
    document["materials"][0]["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    let scene = workplace.input("scene.gltf", document.to_string().as_bytes());
    let output = workplace.output("image.exr");
    render(&scene, &output, &["--spp", "1"]);
    let image = read_exr(Path::new(&output)).unwrap();
    assert!(image.pixels.contains(&[1.0; 3]) && image.pixels.contains(&[0.0; 3]));
}

#[test]
fn only_the_front_of_an_emitter_is_bright() {
    let workplace = Workplace::new();
    let sees_light = |scale: Value, rotation: Value| {
        let (mut document, bytes) = triangles(&TRIANGLE);
        document["materials"][0]["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
        document["nodes"] = json!([{ "mesh": 0, "scale": scale, "rotation": rotation }]);
        let scene = workplace.input("scene.glb", &glb(&document, &bytes));
        let output = workplace.output("image.exr");
        render(&scene, &output, &["--spp", "1"]);
        read_exr(Path::new(&output)).unwrap().pixels.contains(&[1.0; 3])
    };
    let (none, half_turn) = (json!([0, 0, 0, 1]), json!([0, 1, 0, 0]));
    assert!(sees_light(json!([1, 1, 1]), none.clone()));
    assert!(sees_light(json!([-1, 1, 1]), none.clone()));
    assert!(!sees_light(json!([1, 1, -1]), none));
    assert!(!sees_light(json!([1, 1, 1]), half_turn.clone()));
    assert!(sees_light(json!([1, 1, -1]), half_turn));
}

#[test]
fn a_comparison_in_json_has_the_agreed_keys() {
    let workplace = Workplace::new();
    let write = |name: &str, pixel: [f32; 3]| {
        let path = workplace.output(name);
        write_exr(Path::new(&path), &Image { width: 2, height: 1, pixels: vec![pixel; 2] }, &[]).unwrap();
        path
    };
    let (grey, black) = (write("grey.exr", [0.5; 3]), write("black.exr", [0.0; 3]));
    let compared = |a: &str, b: &str| -> Value {
        let outcome = run(["compare", a, b, "--json"]);
        assert_done(&outcome);
        serde_json::from_str(&outcome.stdout).unwrap()
    };
    let same = compared(&grey, &grey);
    let mut keys: Vec<&str> = same.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    let expected =
        ["differing_words", "identical", "max_ulp", "mean_ratio", "rel_mse", "rmae", "rmse", "rmspe", "smape"];
    assert_eq!(keys, expected);
    assert_eq!((&same["identical"], &same["mean_ratio"]), (&json!(true), &json!(1.0)));
    let other = compared(&grey, &black);
    assert_eq!((&other["identical"], &other["differing_words"]), (&json!(false), &json!(6)));
    assert!(other["mean_ratio"].is_null() && other["rmae"].is_null(), "{other}");
}

#[test]
fn images_of_different_sizes_are_refused() {
    let workplace = Workplace::new();
    let write = |width: u32| {
        let path = workplace.output(&format!("{width}.exr"));
        let image = Image { width, height: 1, pixels: vec![[0.0; 3]; width as usize] };
        write_exr(Path::new(&path), &image, &[]).unwrap();
        path
    };
    assert_refused(&run(["compare", &write(1), &write(2)]), &["different sizes", "1 x 1", "2 x 1"]);
}

#[test]
fn layers_show_the_reservoirs_and_leave_the_image_as_it_is() {
    let workplace = Workplace::new();
    let [plain, layered] = ["plain.exr", "layered.exr"].map(|name| workplace.output(name));
    let common = ["--technique", "restir-di", "--frames", "5"];
    render("moving", &plain, &common);
    render("moving", &layered, &[&common[..], &["--layers"]].concat());
    assert_eq!(read_exr(Path::new(&plain)).unwrap(), read_exr(Path::new(&layered)).unwrap());
    let compared = run(["compare", &plain, &layered]);
    assert_done(&compared);
    assert!(compared.stdout.lines().any(|line| line.starts_with("identical") && line.ends_with("yes")));
    let channels = |path: &str| {
        let image = exr::prelude::read_first_flat_layer_from_file(path).unwrap();
        let list = image.layer_data.channel_data.list;
        list.iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect::<Vec<(_, Vec<_>)>>()
    };
    assert_eq!(channels(&plain).len(), 3);
    let layers = channels(&layered);
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
    let arguments = ["render", "cornell", "-o", &workplace.output("path.exr"), "--layers"];
    assert_refused(&run(arguments), &["--layers"]);
}
