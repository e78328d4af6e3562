//! Every bad input gives one sentence and exit code 2, and leaves no file.

use std::process::Command;

use serde_json::{Value, json};

use crate::support::{Outcome, TRIANGLE, Workplace, changed, finish, glb, program, run, triangles};

/// A render of `scene` is refused.
#[track_caller]
fn assert_scene_refused(workplace: &Workplace, scene: &str, more: &[&str], words: &[&str]) {
    workplace.refuses(&mut workplace.render("image.exr", scene, more), words);
}

#[track_caller]
fn assert_file_refused(bytes: &[u8], words: &[&str]) {
    let workplace = Workplace::new();
    let scene = workplace.input("scene.glb", bytes);
    assert_scene_refused(&workplace, &scene, &[], words);
    run(["info", &scene]).refused(words);
}

#[track_caller]
fn assert_options_refused(more: &[&str], words: &[&str]) {
    assert_scene_refused(&Workplace::new(), "cornell", more, words);
}

#[test]
fn a_missing_file_and_an_unknown_scene() {
    for name in ["missing.glb", "missing.gltf"] {
        assert_scene_refused(&Workplace::new(), name, &[], &["cannot read", name]);
    }
    let words = ["teapot", "cornell", "cornell-mitsuba", "furnace"];
    assert_scene_refused(&Workplace::new(), "teapot", &[], &words);
}

#[test]
fn a_truncated_binary_file() {
    let file = glb(&triangles(&TRIANGLE));
    for length in [3, 10, 30, file.len() / 2, file.len() - 1] {
        assert_file_refused(&file[..length], &["scene.glb"]);
    }
    assert_file_refused(&file[..file.len() - 1], &["cut off"]);
}

#[test]
fn a_document_that_cannot_be_right() {
    const EXTENSION: &str = "KHR_draco_mesh_compression";
    let refused = |change: fn(&mut Value), words: &[&str]| {
        assert_file_refused(&glb(&changed(change)), words);
    };
    refused(|d| d["extensionsRequired"] = json!([EXTENSION]), &[EXTENSION, "not supported"]);
    refused(|d| d["accessors"][0]["count"] = json!(4), &["shape", "beyond"]);
    refused(|d| d["accessors"][0]["count"] = json!(u64::MAX), &["shape", "beyond"]);
    // nodes in a circle
    refused(|d| d["nodes"] = json!([{ "children": [1] }, { "children": [0], "mesh": 0 }]), &["node 0", "twice"]);
    // a small file that asks for all memory
    let huge = |d: &mut Value| {
        d["meshes"][0]["primitives"] = json!(vec![d["meshes"][0]["primitives"][0].clone(); 40]);
        d["accessors"][0] = json!({ "componentType": 5126, "count": 130_000_000, "type": "VEC3" });
    };
    refused(huge, &["meshes and animations take", "GiB"]);
}

#[test]
fn a_vertex_that_is_not_finite() {
    for value in [f32::NAN, f32::INFINITY] {
        let scene = triangles(&[[0.0; 3], [1.0, 0.0, value], [0.0, 1.0, 0.0]]);
        assert_file_refused(&glb(&scene), &["shape", "vertex 1", "not finite"]);
    }
}

#[test]
fn an_external_buffer_that_is_no_file_of_the_folder() {
    let workplace = Workplace::new();
    let uris = [("missing.bin", "missing.bin"), ("out", "folder"), ("/dev/zero", "relative"), ("../x", "relative")];
    for (uri, word) in uris {
        let (document, _) = changed(|d| d["buffers"][0]["uri"] = json!(uri));
        let scene = workplace.input("scene.gltf", document.to_string().as_bytes());
        assert_scene_refused(&workplace, &scene, &[], &[word]);
    }
}

#[test]
#[cfg(unix)]
fn what_is_no_regular_file() {
    let workplace = Workplace::new();
    let [folder, device] = ["folder.glb", "device.glb"].map(|name| workplace.output(name));
    std::fs::create_dir(&folder).unwrap();
    std::os::unix::fs::symlink("/dev/zero", &device).unwrap();
    run(["info", &folder]).refused(&["folder.glb", "it is a folder"]);
    run(["info", &device]).refused(&["device.glb", "device"]);
    run(["compare", "/dev/zero", "/dev/zero"]).refused(&["/dev/zero", "device"]);
}

#[test]
fn scenes_for_which_there_is_no_default_light() {
    let workplace = Workplace::new();
    let refused = |scene: &(Value, Vec<u8>), words: &[&str]| {
        assert_scene_refused(&workplace, &workplace.scene(scene), &["--default-light"], words);
    };
    let flat = triangles(&[[1.0; 3]; 3]);
    assert_file_refused(&glb(&flat), &["scene.glb", "triangle"]);
    refused(&flat, &["scene.glb", "no triangle with an area"]);
    refused(&triangles(&[[0.0; 3], [1e9, 0.0, 0.0], [0.0, 1e9, 0.0]]), &["too large", "default light"]);
}

#[test]
fn degenerate_triangles_are_counted() {
    let same = [[2.0, 2.0, 2.0]; 3];
    let in_line = [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [3.0, 3.0, 3.0]];
    let scene = triangles([TRIANGLE, same, in_line].as_flattened());
    let stdout = run(["info", &Workplace::new().scene(&scene)]).done().stdout;
    let row = |name: &str| stdout.lines().find(|line| line.starts_with(name)).unwrap();
    assert!(row("triangles").ends_with(" 1") && row("skipped").contains(" 2 degenerate"), "{stdout}");
}

#[test]
fn a_scene_without_light_is_black_and_says_so() {
    let workplace = Workplace::new();
    let scene = workplace.scene(&triangles(&TRIANGLE));
    let dark = finish(&mut workplace.render("image.exr", &scene, &[])).done();
    assert!(dark.stderr.lines().any(|line| line.starts_with("warning:") && line.contains("no light")));
    assert_eq!(workplace.outputs(), ["image.exr"]);
    let lit = finish(&mut workplace.render("image.exr", &scene, &["--default-light"])).done();
    assert!(!lit.stderr.contains("warning"), "{}", lit.stderr);
}

#[test]
fn numbers_that_cannot_be() {
    for size in ["0x0", "0x8", "8x0", "16385x1", "1x16385", "4294967296x4294967296", "1x99999999999999999999"] {
        assert_options_refused(&["--size", size], &["image"]);
    }
    assert_options_refused(&["--spp", "0"], &["0 samples"]);
    for samples in ["4294967296", "99999999999999999999"] {
        assert_options_refused(&["--spp", samples], &["at most 4294967295"]);
    }
    for option in ["--seed", "--size", "--threads", "--spp", "--max-depth"] {
        assert_options_refused(&[option, "-1"], &[option, "-1", "it has to be"]);
        assert_options_refused(&[option, "x"], &[option, "it has to be"]);
    }
    assert_options_refused(&["--seed", "4294967296"], &["--seed", "less than 2^32"]);
    for threads in ["0", "1025"] {
        assert_options_refused(&["--threads", threads], &["--threads", "1 to 1024"]);
    }
}

#[test]
fn arguments_that_do_not_exist() {
    assert_options_refused(&["--sze", "8x8"], &["--sze", "--size"]);
    assert_options_refused(&["--samples", "4"], &["--samples", "it has to be A..B", "--spp"]);
    assert_options_refused(&["--width=64"], &["--width", "here it is --size"]);
    let unknown = finish(&mut Workplace::new().render("image.exr", "cornell", &["--zzz"])).refused(&["--zzz"]);
    assert!(!unknown.stderr.contains("-- --zzz"), "{}", unknown.stderr);
    assert_options_refused(&["--flavour", "slow"], &["slow", "exact, fast", "--help"]);
    for arguments in [&[][..], &["render"], &["draw"], &["compare", "one.exr"]] {
        let stderr = run(arguments).refused(&[]).stderr;
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
    }
    for asked in ["--help", "--version"] {
        run([asked]).says(&["restir"]);
    }
}

#[test]
fn a_limit_of_memory() {
    let workplace = Workplace::new();
    let scene = workplace.scene(&triangles(&TRIANGLE));
    let refused = |mut command: Command, limit: &str, words: &[&str]| {
        workplace.refuses(command.env("RESTIR_MEMORY_LIMIT_BYTES", limit), words);
    };
    refused(workplace.render("image.exr", "cornell", &["--size", "64x64"]), "1000", &["memory"]);
    refused(program(["info", &scene]), "100", &["cannot read", "scene.glb", "more than"]);
    for scene in ["cornell", &scene] {
        let words = ["RESTIR_MEMORY_LIMIT_BYTES", "abc", "number", "unset"];
        refused(workplace.render("image.exr", scene, &[]), "abc", &words);
    }
}

#[test]
fn settings_that_do_not_exist() {
    assert_options_refused(&["--set", "roulete=on"], &["roulete", "roulette", "jitter", "max_depth"]);
    assert_options_refused(&["--set", "roulette=maybe"], &["roulette", "on or off"]);
    assert_options_refused(&["--set", "roulette"], &["--set roulette", "KEY=VALUE"]);
    assert_options_refused(&["--max-depth", "0"], &["depth"]);
    for camera in ["0,0,1", "0,0,1:0,0", "0,0,1:0,0,0:40:1", "x,0,1:0,0,0"] {
        assert_options_refused(&["--camera", camera], &["--camera", "EYE:TARGET"]);
    }
    assert_options_refused(&["--camera", "0,0,1:0,0,1"], &["--camera", "looks nowhere"]);
    assert_options_refused(&["--camera", "0,0,1:0,0,0:180"], &["--camera", "field of view"]);
    assert_options_refused(&["--exposure", "1"], &["--exposure", "give --png"]);
    assert_options_refused(&["--tonemap", "aces"], &["--tonemap", "give --png"]);
    let png = Workplace::new().output("image.png");
    assert_options_refused(&["--png", &png, "--exposure", "nan"], &["--exposure", "stops"]);
    assert_options_refused(&["--png", &png, "--exposure", "x"], &["--exposure", "has to be a number"]);
    assert_options_refused(&["--set", "preset=none"], &["no preset", "there are none"]);
    assert_options_refused(&["--png", &png, "--tonemap", "none"], &["--tonemap", "reinhard", "aces"]);
    for levels in ["12", "40", "4294967295"] {
        assert_options_refused(&["--subdivide", levels], &["--subdivide", "triangles", "fewer levels"]);
    }
    assert_options_refused(&["--jitter", "--set", "jitter=off"], &["--jitter", "jitter=off", "leave"]);
    assert_options_refused(&["--no-jitter", "--set", "jitter=on"], &["--no-jitter", "jitter=on", "leave"]);
    assert_options_refused(&["--jitter", "--no-jitter"], &["--jitter", "--no-jitter"]);
    assert_options_refused(&["--flavour", "fast"], &["fast", "GPU"]);
    assert_options_refused(&["--adapter", "any"], &["--adapter"]);
    assert_options_refused(&["--frames", "3"], &["--frames", "--spp"]);
}

#[test]
fn frames_that_cannot_be() {
    let refused = |more: &[&str], words: &[&str]| {
        assert_options_refused(&[&["--technique", "restir-di"], more].concat(), words);
    };
    refused(&["--frames", "0"], &["0 frames"]);
    refused(&["--spp", "4"], &["--spp", "--frames"]);
    refused(&["--max-depth", "8"], &["2 segments", "--max-depth"]);
    refused(&["--jitter", "--set", "jitter=off"], &["--jitter", "jitter=off", "leave"]);
    refused(&["--camera-path", "none.json"], &["none.json", "orbit"]);
    refused(&["--camera-path", "orbit", "--frames", "4294967295"], &["camera path", "fewer --frames"]);
    refused(&["--emitters", "99999999"], &["emitters", "at most"]);
    let settings = [
        ("preset=none", "biased-2020"),
        ("mis=none", "talbot"),
        ("radius=nan", "radius"),
        ("neighbours=99", "from 1 to 7"),
        ("visibility_reuse=none", "candidates"),
        ("visibility=averaged", "visibility_reuse"),
    ];
    for (setting, word) in settings {
        refused(&["--set", setting], &[word]);
    }
    refused(&["--set", "candidates=3", "--set", "preset=offline"], &["preset=offline", "give it first"]);
}

#[test]
fn outputs_that_cannot_be_written() {
    let workplace = Workplace::new();
    std::fs::create_dir(workplace.output("folder.exr")).unwrap();
    let file = workplace.input("file", b"");
    let refused = |output: &str, more: &[&str], words: &[&str]| {
        run(["render", "cornell", "-o", output, "--device", "cpu"].iter().chain(more)).refused(words);
    };
    let [image, png] = ["image.exr", "missing/image.png"].map(|name| workplace.output(name));
    refused(&workplace.output("missing/image.exr"), &[], &["cannot write", "missing", "does not exist"]);
    refused(&workplace.output("folder.exr"), &[], &["cannot write", "folder"]);
    refused(&workplace.output("image.jpg"), &[], &[".exr"]);
    refused(&format!("{file}/image.exr"), &[], &["cannot write"]);
    refused(&workplace.output(&format!("{}.exr", "x".repeat(300))), &[], &["cannot write", "too long"]);
    refused(&image, &["--png", &png], &["cannot write", "image.png"]);
    refused(&image, &["--png", &image], &["--png", ".png"]);
    refused(&workplace.output("image.####.exr"), &[], &["image.####.exr", "--frames"]);
    assert_eq!(workplace.outputs(), ["folder.exr"]);
}

/// Without a driver there is no adapter to find.
fn without_driver(mut command: Command) -> Outcome {
    finish(command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent"))
}

#[test]
#[cfg(target_os = "linux")]
fn no_gpu() {
    let workplace = Workplace::new();
    let device = |device| without_driver(workplace.render("image.exr", "cornell", &["--spp", "1", "--device", device]));
    device("gpu").refused(&["adapter"]);
    assert_eq!(workplace.outputs(), [""; 0]);
    let auto = device("auto").done();
    assert!(auto.stderr.contains("device: CPU (no GPU adapter"), "{}", auto.stderr);
    without_driver(program(["devices"])).says(&["no GPU adapter"]);
}

#[test]
fn images_that_cannot_be_compared() {
    let workplace = Workplace::new();
    let text = workplace.input("text.exr", b"not an image");
    run(["compare", "missing.exr", "missing.exr"]).refused(&["cannot read", "missing.exr"]);
    run(["compare", &text, &text, "--json"]).refused(&["cannot read", "text.exr"]);
}
