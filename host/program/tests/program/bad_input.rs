//! Every bad input gives one sentence and exit code 2, and leaves no file.

use std::process::Command;

use serde_json::json;

use crate::support::{Outcome, TRIANGLE, Workplace, assert_done, assert_refused, finish, glb, program, run, triangles};

/// A small render of `scene` on the CPU.
fn render(workplace: &Workplace, scene: &str, more: &[&str]) -> Command {
    let output = workplace.output("image.exr");
    let mut command = program(["render", scene, "-o", &output, "--device", "cpu"]);
    for default in [["--size", "8x8"], ["--spp", "1"]] {
        if !more.contains(&default[0]) {
            command.args(default);
        }
    }
    command.args(more);
    command
}

fn assert_render_refused(workplace: &Workplace, command: &mut Command, words: &[&str]) {
    assert_refused(&finish(command), words);
    assert_eq!(workplace.outputs(), [""; 0]);
}

fn assert_file_refused(bytes: &[u8], words: &[&str]) {
    let workplace = Workplace::new();
    let scene = workplace.input("scene.glb", bytes);
    assert_render_refused(&workplace, &mut render(&workplace, &scene, &[]), words);
    assert_refused(&run(["info", &scene]), words);
}

fn assert_options_refused(more: &[&str], words: &[&str]) {
    let workplace = Workplace::new();
    assert_render_refused(&workplace, &mut render(&workplace, "cornell", more), words);
}

#[test]
fn a_missing_file() {
    let workplace = Workplace::new();
    for name in ["missing.glb", "missing.gltf"] {
        assert_render_refused(&workplace, &mut render(&workplace, name, &[]), &["cannot read", name]);
    }
}

#[test]
fn an_unknown_scene_lists_the_known() {
    let workplace = Workplace::new();
    let words = ["teapot", "cornell", "cornell-mitsuba", "furnace"];
    assert_render_refused(&workplace, &mut render(&workplace, "teapot", &[]), &words);
}

#[test]
fn a_truncated_binary_file() {
    let (document, bytes) = triangles(&TRIANGLE);
    let file = glb(&document, &bytes);
    for length in [3, 10, 30, file.len() / 2, file.len() - 1] {
        assert_file_refused(&file[..length], &["scene.glb"]);
    }
    assert_file_refused(&file[..file.len() - 1], &["cut off"]);
}

#[test]
fn a_required_unknown_extension_is_named() {
    let (mut document, bytes) = triangles(&TRIANGLE);
    document["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    assert_file_refused(&glb(&document, &bytes), &["KHR_draco_mesh_compression", "not supported"]);
}

#[test]
fn a_vertex_that_is_not_finite() {
    for value in [f32::NAN, f32::INFINITY] {
        let (document, bytes) = triangles(&[[0.0; 3], [1.0, 0.0, value], [0.0, 1.0, 0.0]]);
        assert_file_refused(&glb(&document, &bytes), &["shape", "vertex 1", "not finite"]);
    }
}

#[test]
fn an_accessor_out_of_range() {
    let (mut document, bytes) = triangles(&TRIANGLE);
    document["accessors"][0]["count"] = json!(4);
    assert_file_refused(&glb(&document, &bytes), &["shape", "beyond"]);
    document["accessors"][0]["count"] = json!(u64::MAX);
    assert_file_refused(&glb(&document, &bytes), &["shape", "beyond"]);
}

#[test]
fn a_missing_external_buffer() {
    let workplace = Workplace::new();
    let (mut document, _) = triangles(&TRIANGLE);
    document["buffers"][0]["uri"] = json!("missing.bin");
    let scene = workplace.input("scene.gltf", document.to_string().as_bytes());
    assert_render_refused(&workplace, &mut render(&workplace, &scene, &[]), &["missing.bin"]);
}

#[test]
fn an_external_buffer_that_is_no_file_of_the_folder() {
    let workplace = Workplace::new();
    let (mut document, _) = triangles(&TRIANGLE);
    for (uri, word) in [("out", "folder"), ("/dev/zero", "relative"), ("../x", "relative")] {
        document["buffers"][0]["uri"] = json!(uri);
        let scene = workplace.input("scene.gltf", document.to_string().as_bytes());
        assert_render_refused(&workplace, &mut render(&workplace, &scene, &[]), &[word]);
    }
}

#[test]
fn a_small_file_that_asks_for_all_memory() {
    let (mut document, bytes) = triangles(&TRIANGLE);
    let primitives = vec![document["meshes"][0]["primitives"][0].clone(); 40];
    document["meshes"][0]["primitives"] = json!(primitives);
    document["accessors"][0] = json!({ "componentType": 5126, "count": 130_000_000, "type": "VEC3" });
    assert_file_refused(&glb(&document, &bytes), &["meshes take", "GiB"]);
}

#[test]
#[cfg(unix)]
fn what_is_no_regular_file() {
    let workplace = Workplace::new();
    let folder = workplace.output("folder.glb");
    std::fs::create_dir(&folder).unwrap();
    let device = workplace.output("device.glb");
    std::os::unix::fs::symlink("/dev/zero", &device).unwrap();
    assert_refused(&run(["info", &folder]), &["folder.glb", "it is a folder"]);
    assert_refused(&run(["info", &device]), &["device.glb", "device"]);
    assert_refused(&run(["compare", "/dev/zero", "/dev/zero"]), &["/dev/zero", "device"]);
}

#[test]
fn a_scene_file_too_large_for_the_memory() {
    let workplace = Workplace::new();
    let (document, bytes) = triangles(&TRIANGLE);
    let scene = workplace.input("scene.glb", &glb(&document, &bytes));
    let mut command = program(["info", &scene]);
    let outcome = finish(command.env("RESTIR_MEMORY_LIMIT_BYTES", "100"));
    assert_refused(&outcome, &["cannot read", "scene.glb", "more than"]);
}

#[test]
fn nodes_in_a_circle() {
    let (mut document, bytes) = triangles(&TRIANGLE);
    document["nodes"] = json!([{ "children": [1] }, { "children": [0], "mesh": 0 }]);
    assert_file_refused(&glb(&document, &bytes), &["node 0", "twice"]);
}

#[test]
fn a_scene_without_a_triangle() {
    let (document, bytes) = triangles(&[[1.0; 3]; 3]);
    assert_file_refused(&glb(&document, &bytes), &["scene.glb", "triangle"]);
    let workplace = Workplace::new();
    let scene = workplace.input("scene.glb", &glb(&document, &bytes));
    let mut lit = render(&workplace, &scene, &["--default-light"]);
    assert_render_refused(&workplace, &mut lit, &["scene.glb", "no triangle with an area"]);
}

#[test]
fn a_scene_too_large_for_a_default_light() {
    let workplace = Workplace::new();
    let (document, bytes) = triangles(&[[0.0; 3], [1e9, 0.0, 0.0], [0.0, 1e9, 0.0]]);
    let scene = workplace.input("scene.glb", &glb(&document, &bytes));
    let mut lit = render(&workplace, &scene, &["--default-light"]);
    assert_render_refused(&workplace, &mut lit, &["too large", "default light"]);
}

#[test]
fn degenerate_triangles_are_counted() {
    let workplace = Workplace::new();
    let same = [[2.0, 2.0, 2.0]; 3];
    let in_line = [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [3.0, 3.0, 3.0]];
    let (document, bytes) = triangles([TRIANGLE, same, in_line].as_flattened());
    let scene = workplace.input("scene.glb", &glb(&document, &bytes));
    let outcome = run(["info", &scene]);
    assert_done(&outcome);
    let row = |name: &str| outcome.stdout.lines().find(|line| line.starts_with(name)).unwrap().to_owned();
    assert!(row("triangles").ends_with(" 1"), "{}", outcome.stdout);
    assert!(row("skipped").contains(" 2 degenerate"), "{}", outcome.stdout);
}

#[test]
fn a_scene_without_light_is_black_and_says_so() {
    let workplace = Workplace::new();
    let (document, bytes) = triangles(&TRIANGLE);
    let scene = workplace.input("scene.glb", &glb(&document, &bytes));
    let outcome = finish(&mut render(&workplace, &scene, &[]));
    assert_done(&outcome);
    assert!(outcome.stderr.lines().any(|line| line.starts_with("warning:") && line.contains("no light")));
    assert_eq!(workplace.outputs(), ["image.exr"]);
    let lit = finish(&mut render(&workplace, &scene, &["--default-light"]));
    assert_done(&lit);
    assert!(!lit.stderr.contains("warning"), "{}", lit.stderr);
}

#[test]
fn sizes_out_of_range() {
    for size in ["0x0", "0x8", "8x0", "16385x1", "1x16385", "4294967296x4294967296", "1x99999999999999999999"] {
        assert_options_refused(&["--size", size], &["image"]);
    }
}

#[test]
fn samples_out_of_range() {
    assert_options_refused(&["--spp", "0"], &["0 samples"]);
    for samples in ["4294967296", "99999999999999999999"] {
        assert_options_refused(&["--spp", samples], &["samples > 4294967295"]);
    }
}

#[test]
fn numbers_that_are_none() {
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
    assert_options_refused(&["--flavour", "slow"], &["slow", "exact, fast", "--help"]);
    for arguments in [&[][..], &["render"], &["draw"], &["compare", "one.exr"]] {
        let outcome = run(arguments);
        assert_refused(&outcome, &[]);
        assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
    }
    for asked in ["--help", "--version"] {
        let outcome = run([asked]);
        assert_done(&outcome);
        assert!(outcome.stdout.contains("restir"), "{}", outcome.stdout);
    }
}

#[test]
fn too_much_memory() {
    let workplace = Workplace::new();
    let mut command = render(&workplace, "cornell", &["--size", "64x64"]);
    command.env("RESTIR_MEMORY_LIMIT_BYTES", "1000");
    assert_render_refused(&workplace, &mut command, &["memory"]);
}

#[test]
fn a_limit_of_memory_that_is_no_number() {
    let workplace = Workplace::new();
    let (document, bytes) = triangles(&TRIANGLE);
    let scene = workplace.input("scene.glb", &glb(&document, &bytes));
    for scene in ["cornell", &scene] {
        let mut command = render(&workplace, scene, &[]);
        command.env("RESTIR_MEMORY_LIMIT_BYTES", "abc");
        assert_render_refused(&workplace, &mut command, &["RESTIR_MEMORY_LIMIT_BYTES", "abc", "number", "unset"]);
    }
}

#[test]
fn settings_that_do_not_exist() {
    assert_options_refused(&["--set", "roulete=on"], &["roulete", "roulette", "jitter", "max_depth"]);
    assert_options_refused(&["--set", "roulette=maybe"], &["roulette", "on or off"]);
    assert_options_refused(&["--set", "roulette"], &["roulette", "on or off"]);
    assert_options_refused(&["--max-depth", "0"], &["depth"]);
    for levels in ["12", "40", "4294967295"] {
        assert_options_refused(&["--subdivide", levels], &["--subdivide", "triangles", "fewer levels"]);
    }
    assert_options_refused(&["--jitter", "--set", "jitter=off"], &["--jitter", "jitter=off", "leave"]);
    assert_options_refused(&["--flavour", "fast"], &["fast", "GPU"]);
    assert_options_refused(&["--adapter", "any"], &["--adapter"]);
}

#[test]
fn frames_that_cannot_be() {
    let refused = |more: &[&str], words: &[&str]| {
        let workplace = Workplace::new();
        let output = workplace.output("image.exr");
        let mut command = program(["render", "cornell", "-o", &output, "--device", "cpu", "--size", "8x8"]);
        assert_render_refused(&workplace, command.args(["--technique", "restir-di"]).args(more), words);
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
    assert_options_refused(&["--frames", "3"], &["--frames", "--spp"]);
}

#[test]
fn outputs_that_cannot_be_written() {
    let workplace = Workplace::new();
    std::fs::create_dir(workplace.output("folder.exr")).unwrap();
    let file = workplace.input("file", b"");
    let refused = |output: &str, words: &[&str]| {
        assert_refused(&run(["render", "cornell", "-o", output, "--device", "cpu"]), words);
    };
    refused(&workplace.output("missing/image.exr"), &["cannot write", "missing", "does not exist"]);
    refused(&workplace.output("folder.exr"), &["cannot write", "folder"]);
    refused(&workplace.output("image.jpg"), &[".exr"]);
    refused(&format!("{file}/image.exr"), &["cannot write"]);
    let png = workplace.output("missing/image.png");
    assert_refused(&finish(&mut render(&workplace, "cornell", &["--png", &png])), &["cannot write", "image.png"]);
    refused(&workplace.output(&format!("{}.exr", "x".repeat(300))), &["cannot write", "too long"]);
    let same = workplace.output("image.exr");
    assert_refused(&finish(&mut render(&workplace, "cornell", &["--png", &same])), &["--png", ".png"]);
    assert_eq!(workplace.outputs(), ["folder.exr"]);
}

/// Without a driver there is no adapter to find.
fn without_driver(command: &mut Command) -> Outcome {
    finish(command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent"))
}

#[test]
#[cfg(target_os = "linux")]
fn no_gpu() {
    let workplace = Workplace::new();
    let output = workplace.output("image.exr");
    let gpu = without_driver(&mut program(["render", "cornell", "-o", &output, "--device", "gpu", "--size", "8x8"]));
    assert_refused(&gpu, &["adapter"]);
    assert_eq!(workplace.outputs(), [""; 0]);
    let auto = without_driver(&mut program(["render", "cornell", "-o", &output, "--spp", "1", "--size", "8x8"]));
    assert_done(&auto);
    assert!(auto.stderr.contains("device: CPU (no GPU adapter"), "{}", auto.stderr);
    let devices = without_driver(&mut program(["devices"]));
    assert_done(&devices);
    assert!(devices.stdout.contains("no GPU adapter"), "{}", devices.stdout);
}

#[test]
fn images_that_cannot_be_compared() {
    let workplace = Workplace::new();
    let text = workplace.input("text.exr", b"not an image");
    assert_refused(&run(["compare", "missing.exr", "missing.exr"]), &["cannot read", "missing.exr"]);
    assert_refused(&run(["compare", &text, &text, "--json"]), &["cannot read", "text.exr"]);
}
