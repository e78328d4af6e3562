//! What hostile and careless use found, and the tasks at which new users failed, as far as no other test is about them.

use std::path::Path;
use std::time::Instant;

use serde_json::json;

use crate::support::{TRIANGLE, Workplace, changed, finish, program, run, triangles};

/// Building the tree took time with the square of the number of triangles in the same place: ten seconds for these.
#[test]
fn triangles_in_the_same_place_are_built_as_fast_as_others() {
    const COUNT: usize = 20_000;
    let workplace = Workplace::new();
    let seconds = |triangle: &dyn Fn(usize) -> [[f32; 3]; 3]| {
        let positions: Vec<[f32; 3]> = (0..COUNT).flat_map(triangle).collect();
        let scene = workplace.scene(&triangles(&positions));
        let start = Instant::now();
        run(["info", &scene]).says(&["20000"]);
        start.elapsed().as_secs_f64()
    };
    let apart = seconds(&|i| TRIANGLE.map(|[x, y, z]| [x + (i % 141) as f32, y + (i / 141) as f32, z]));
    let together = seconds(&|_| TRIANGLE);
    assert!(together < 1.0 + 10.0 * apart, "{together} s and {apart} s");
}

/// A reference is what it was, whichever bit of its cache has changed: what is damaged is made anew.
#[test]
fn a_damaged_cache_is_not_believed() {
    let workplace = Workplace::new();
    let (cache, output) = (tempfile::tempdir().unwrap(), workplace.output("r.exr"));
    let made = || {
        let mut command = program(["reference", "cornell", "--size", "4x3", "--spp", "128", "--device", "cpu"]);
        finish(command.args(["--threads", "1", "-o", &output, "--cache"]).arg(cache.path())).done();
        std::fs::read(&output).unwrap()
    };
    let expected = made();
    let folder = std::fs::read_dir(cache.path()).unwrap().next().unwrap().unwrap().path();
    let half = folder.join("half0.exr");
    let whole = std::fs::read(&half).unwrap();
    for flip in 0..150 {
        let mut damaged = whole.clone();
        let bit = flip * 8 * whole.len() / 150 + flip % 8;
        damaged[bit / 8] ^= 1 << (bit % 8);
        std::fs::write(&half, damaged).unwrap();
        assert!(made() == expected, "bit {bit}");
    }
}

/// A small file can place a large mesh many times: that is judged before anything is made of it.
#[test]
fn many_instances_are_judged_before_they_are_built() {
    let positions: Vec<[f32; 3]> = (0..2000).flat_map(|i| TRIANGLE.map(|[x, y, z]| [x + i as f32, y, z])).collect();
    let mut scene = triangles(&positions);
    scene.0["nodes"] = (0..1000).map(|i| json!({ "mesh": 0, "translation": [0, i, 0] })).collect();
    scene.0["scenes"] = json!([{ "nodes": (0..1000).collect::<Vec<_>>() }]);
    let workplace = Workplace::new();
    let file = workplace.scene(&scene);
    let start = Instant::now();
    let mut command = program(["info", &file]);
    finish(command.env("RESTIR_MEMORY_LIMIT_BYTES", "200000000")).refused(&["would take", "MiB", "smaller scene"]);
    assert!(start.elapsed().as_secs_f64() < 5.0);
}

#[test]
fn words_are_those_of_the_user() {
    let workplace = Workplace::new();
    let mut command = workplace.render("image.exr", "cornell", &[]);
    let outcome = finish(command.env("RESTIR_MEMORY_LIMIT_BYTES", "0")).refused(&["RESTIR_MEMORY_LIMIT_BYTES", "KiB"]);
    assert!(!outcome.stderr.contains("0.00 GiB") && !outcome.stderr.contains("subdivided"), "{}", outcome.stderr);
    for threads in ["0", "1025", "4294967295"] {
        let more = ["--threads", threads];
        let outcome = finish(&mut workplace.render("image.exr", "cornell", &more)).refused(&["1 to 1024"]);
        assert!(!outcome.stderr.contains("Some(") && !outcome.stderr.contains("None"), "{}", outcome.stderr);
    }
}

/// What is wrong with a file is said with what to do, in the words of no programming language.
#[test]
fn errors_of_files_say_what_to_do() {
    let workplace = Workplace::new();
    let lens = changed(|d| d["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1 } }]));
    let image = |uri: &str| {
        changed(|d| {
            d["images"] = json!([{ "uri": uri }]);
            d["textures"] = json!([{ "source": 0 }]);
            d["materials"][0]["emissiveTexture"] = json!({ "index": 0 });
        })
    };
    workplace.input("broken.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01");
    let text = workplace.input("text.exr", b"no image");
    let of_scene = |scene| run(["info", &workplace.scene(&scene)]);
    let outcomes = [
        of_scene(lens).refused(&["znear", "export it again"]),
        of_scene(image("broken.png")).refused(&["broken.png", "PNG is broken", "save it anew"]),
        of_scene(image("text.exr")).refused(&["text.exr", "neither a PNG nor a JPEG", "convert it"]),
        of_scene(image("none.png")).refused(&["none.png", "No such file"]),
        finish(&mut workplace.render("image.exr", "cornell", &["--env", &text])).refused(&["text.exr", "give an EXR"]),
        run(["compare", &text, &text]).refused(&["text.exr", "give an EXR"]),
    ];
    for outcome in outcomes {
        assert!(!outcome.stderr.contains(['{', '}']) && !outcome.stderr.contains("Error"), "{}", outcome.stderr);
    }
}

#[test]
fn images_describe_themselves() {
    let workplace = Workplace::new();
    workplace.picture("image.exr", "cornell", &["--spp", "3", "--aov", "depth"]);
    let image = workplace.output("image.exr");
    run(["info", &image]).says(&["16 x 12", "R", "Depth.Z", "scene            cornell", "samples          3"]);
    assert!(Path::new(&image).exists());
    run(["info", &workplace.output("none.exr")]).refused(&["none.exr", "No such file"]);
}

#[test]
fn other_ways_of_asking_are_answered() {
    let workplace = Workplace::new();
    let png = workplace.output("image.png");
    workplace.picture("image.exr", "cornell", &["--spp", "1", "--png", &png]);
    run(["compare", &png, &png]).refused(&["image.png", "compare the EXR files"]);
    std::fs::remove_file(&png).unwrap();
    std::fs::remove_file(workplace.output("image.exr")).unwrap();
    for (asked, here) in [
        ("--samples", "--spp"),
        ("--width", "--size"),
        ("--fov", "--camera"),
        ("--animation", "--frames A..B"),
        ("--display-server", "--tev"),
        ("--aovs", "--aov"),
    ] {
        let mut command = workplace.render("image.exr", "cornell", &[asked, "4"]);
        workplace.refuses(&mut command, &[asked, here]);
    }
    let outcome = finish(&mut workplace.render("image.exr", "cornell", &["--expsure", "4"])).refused(&["--exposure"]);
    assert!(!outcome.stderr.contains("as a value"), "{}", outcome.stderr);
    let dark = workplace.scene(&triangles(&TRIANGLE));
    let outcome = finish(&mut workplace.render("image.exr", &dark, &["--spp", "1"])).done_whatever_it_says();
    assert!(outcome.stderr.contains("no light") && outcome.stderr.contains("--default-light"), "{}", outcome.stderr);
}
