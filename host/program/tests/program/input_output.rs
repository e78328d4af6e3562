//! Environments, lenses, textures, and the export.

use std::path::Path;

use restir::image::{Image, read_exr, read_exr_metadata, write_exr};
use restir::scene::Scene;
use serde_json::{Value, json};

use crate::support::{TRIANGLE, Workplace, assert_done, assert_refused, glb, run, triangles};

fn sky(workplace: &Workplace, name: &str, pixels: Vec<[f32; 3]>) -> String {
    let path = workplace.input(name, b"");
    let height = pixels.len() as u32 / 2;
    write_exr(Path::new(&path), &Image { width: 2, height, pixels }, &[]).unwrap();
    path
}

fn render<'a>(output: &'a str, scene: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let common = ["render", scene, "-o", output, "--device", "cpu", "--size", "8x8", "--spp", "1"];
    common.iter().chain(more).copied().collect()
}

fn value(image: &str, key: &str) -> String {
    let metadata = read_exr_metadata(Path::new(image)).unwrap();
    metadata.into_iter().find(|(name, _)| name == key).map(|(_, value)| value).unwrap()
}

#[test]
fn an_exported_scene_renders_the_same_bits() {
    let workplace = Workplace::new();
    let file = workplace.output("cornell.glb");
    let outcome = run(["export", "cornell", &file]);
    assert_done(&outcome);
    assert!(outcome.stdout.contains("wrote") && outcome.stdout.contains(&file), "{}", outcome.stdout);
    let [own, exported] = ["own.exr", "exported.exr"].map(|name| workplace.output(name));
    assert_done(&run(render(&own, "cornell", &[])));
    assert_done(&run(render(&exported, &file, &[])));
    assert_eq!(read_exr(Path::new(&own)).unwrap(), read_exr(Path::new(&exported)).unwrap());
    assert_eq!(workplace.outputs(), ["cornell.glb", "exported.exr", "own.exr"]);
}

#[test]
fn an_environment_is_written_beside_the_scene() {
    let workplace = Workplace::new();
    let sky = sky(&workplace, "sky.exr", vec![[0.5, 1.0, 2.0]; 2]);
    let file = workplace.output("lit.glb");
    let outcome = run([
        "export",
        "furnace",
        &file,
        "--env",
        &sky,
        "--env-scale",
        "3",
        "--env-rotate",
        "-90",
        "--aperture-radius",
        "0.1",
    ]);
    assert_done(&outcome);
    for words in ["lit.env.exr", "--env-scale 3 --env-rotate -90", "no lens"] {
        assert!(outcome.stdout.contains(words), "{}", outcome.stdout);
    }
    assert_eq!(workplace.outputs(), ["lit.env.exr", "lit.glb"]);
    let beside = workplace.output("lit.env.exr");
    assert_eq!(read_exr(Path::new(&beside)).unwrap(), read_exr(Path::new(&sky)).unwrap());
    assert_eq!(Scene::load(&file).unwrap().camera.unwrap().lens_radius, 0.1);
}

#[test]
fn an_export_that_cannot_be_written_leaves_nothing() {
    let workplace = Workplace::new();
    let refused = |arguments: &[&str], words: &[&str]| {
        assert_refused(&run([&["export"], arguments].concat()), words);
        assert_eq!(workplace.outputs(), [""; 0]);
    };
    refused(&["cornell", &workplace.output("scene.gltf")], &[".glb"]);
    refused(&["cornell", &workplace.output("missing/scene.glb")], &["cannot write", "missing"]);
    refused(&["teapot", &workplace.output("scene.glb")], &["teapot", "cornell"]);
}

#[test]
fn a_picture_says_what_it_was_lit_by_and_seen_through() {
    let workplace = Workplace::new();
    let sky = sky(&workplace, "sky.exr", vec![[1.0; 3]; 4]);
    let image = workplace.output("image.exr");
    let flags = ["--env", &sky, "--env-scale", "0.5", "--aperture-radius", "0.25", "--focus-distance", "3"];
    let outcome = run(render(&image, "cornell", &flags));
    assert_done(&outcome);
    assert!(value(&image, "environment").ends_with("sky.exr, scale 0.5, turned 0 degrees"));
    assert_eq!(value(&image, "lens"), "radius 0.25, sharp at 3");
    assert_done(&run(render(&image, "cornell", &[])));
    assert_eq!((value(&image, "environment").as_str(), value(&image, "lens").as_str()), ("none", "pinhole"));
}

#[test]
fn environments_that_cannot_be_used() {
    let workplace = Workplace::new();
    let good = sky(&workplace, "sky.exr", vec![[1.0; 3]; 2]);
    let nan = sky(&workplace, "nan.exr", vec![[1.0; 3], [1.0, f32::NAN, 1.0]]);
    let text = workplace.input("text.exr", b"no image");
    let image = workplace.output("image.exr");
    let refused = |flags: &[&str], words: &[&str]| {
        assert_refused(&run(render(&image, "cornell", flags)), words);
        assert_eq!(workplace.outputs(), [""; 0]);
    };
    refused(&["--env", "missing.exr"], &["cannot read", "missing.exr"]);
    refused(&["--env", &text], &["cannot read", "text.exr"]);
    refused(&["--env", &nan], &["nan.exr", "x 1, y 0", "not finite"]);
    refused(&["--env-scale", "2"], &["--env"]);
    for scale in ["-1", "nan", "inf", "1e30"] {
        refused(&["--env", &good, "--env-scale", scale], &["scale"]);
    }
    refused(&["--env", &good, "--env-rotate", "inf"], &["turn", "finite"]);
    refused(&["--env", &good, "--env-rotate", "left"], &["--env-rotate", "left"]);
}

#[test]
fn negative_pixels_are_told() {
    let workplace = Workplace::new();
    let sky = sky(&workplace, "sky.exr", vec![[1.0; 3], [-1.0, 0.0, 0.0]]);
    let outcome = run(render(&workplace.output("image.exr"), "cornell", &["--env", &sky]));
    assert_done(&outcome);
    assert!(outcome.stderr.contains("1 of its pixels are negative"), "{}", outcome.stderr);
}

#[test]
fn lenses_that_cannot_be_used() {
    let workplace = Workplace::new();
    let image = workplace.output("image.exr");
    let refused = |flags: &[&str], words: &[&str]| {
        assert_refused(&run(render(&image, "cornell", flags)), words);
        assert_eq!(workplace.outputs(), [""; 0]);
    };
    for radius in ["-1", "nan", "1e30"] {
        refused(&["--aperture-radius", radius], &["lens radius"]);
    }
    for distance in ["0", "-1", "nan", "inf"] {
        refused(&["--aperture-radius", "0.1", "--focus-distance", distance], &["focus distance"]);
    }
    refused(&["--focus-distance", "1"], &["--aperture-radius"]);
}

/// A triangle with a texture of two by one texels, a point light, and its bytes.
fn textured() -> (Value, Vec<u8>) {
    let (mut document, mut bytes) = triangles(&TRIANGLE);
    let mut image = Vec::new();
    let mut writer = png::Encoder::new(&mut image, 2, 1).write_header().unwrap();
    writer.write_image_data(&[0, 255]).unwrap();
    writer.finish().unwrap();
    let [uvs, end] = [bytes.len(), bytes.len() + 24];
    bytes.extend([[0.0_f32, 1.0], [1.0, 1.0], [0.0, 0.0]].as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(&image);
    document["buffers"][0]["byteLength"] = json!(bytes.len());
    let views = document["bufferViews"].as_array_mut().unwrap();
    views.push(json!({ "buffer": 0, "byteOffset": uvs, "byteLength": 24 }));
    views.push(json!({ "buffer": 0, "byteOffset": end, "byteLength": image.len() }));
    let accessors = document["accessors"].as_array_mut().unwrap();
    accessors.push(json!({ "bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2" }));
    document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(1);
    document["images"] = json!([{ "name": "stripes", "bufferView": 2, "mimeType": "image/png" }]);
    document["textures"] = json!([{ "source": 0 }]);
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    document["nodes"] = json!([{ "mesh": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } }]);
    (document, bytes)
}

#[test]
fn textures_and_lights_are_described() {
    let workplace = Workplace::new();
    let (document, bytes) = textured();
    let outcome = run(["info", &workplace.input("scene.glb", &glb(&document, &bytes))]);
    assert_done(&outcome);
    for (row, end) in [("textures", "1 with 2 texels"), ("lights", "0 triangles, 1 point"), ("environment", "none")] {
        let line = outcome.stdout.lines().find(|line| line.starts_with(row)).unwrap();
        assert!(line.ends_with(end), "{line}");
    }
    assert!(!outcome.stdout.contains("warning"), "{}", outcome.stdout);
}

#[test]
fn broken_textures_are_refused() {
    let workplace = Workplace::new();
    let (good, bytes) = textured();
    let refused = |change: fn(&mut Value), words: &[&str]| {
        let mut document = good.clone();
        change(&mut document);
        let scene = workplace.input("scene.glb", &glb(&document, &bytes));
        assert_refused(&run(["info", &scene]), words);
    };
    refused(|d| d["images"][0]["bufferView"] = json!(1), &["stripes", "neither a PNG nor a JPEG"]);
    refused(|d| d["images"][0]["bufferView"] = json!(9), &["stripes", "buffer view 9"]);
    refused(|d| d["bufferViews"][2]["byteLength"] = json!(50), &["stripes", "PNG"]);
    refused(|d| d["images"][0] = json!({ "uri": "missing.jpg" }), &["cannot read", "missing.jpg"]);
    refused(|d| d["textures"][0]["source"] = json!(5), &["texture 0", "no PNG or JPEG"]);
    refused(|d| d["accessors"][1]["count"] = json!(2), &["shape", "texture coordinates for 2"]);
    refused(|d| d["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = json!(3), &["light 3"]);
}
