//! Environments, lenses, textures, and the export.

use std::path::Path;

use restir::image::{Image, read_exr, read_exr_metadata, write_exr};
use restir::scene::Scene;
use serde_json::{Value, json};

use crate::support::{TRIANGLE, Workplace, finish, program, run, triangles};

fn sky(workplace: &Workplace, name: &str, pixels: Vec<[f32; 3]>) -> String {
    let path = workplace.input(name, b"");
    let height = pixels.len() as u32 / 2;
    write_exr(Path::new(&path), &Image { width: 2, height, pixels }, &[]).unwrap();
    path
}

/// A render of the Cornell box with such options is refused.
fn assert_options_refused(workplace: &Workplace, more: &[&str], words: &[&str]) {
    workplace.refuses(&mut workplace.render("image.exr", "cornell", more), words);
}

#[test]
fn an_exported_scene_renders_the_same_bits() {
    let workplace = Workplace::new();
    let file = workplace.output("cornell.glb");
    run(["export", "cornell", &file]).says(&["wrote", &file]);
    let [own, exported] = ["cornell", &file].map(|scene| workplace.picture("image.exr", scene, &["--spp", "1"]));
    assert_eq!(own, exported);
    assert_eq!(workplace.outputs(), ["cornell.glb", "image.exr"]);
}

#[test]
fn an_environment_is_written_beside_the_scene() {
    let workplace = Workplace::new();
    let sky = sky(&workplace, "sky.exr", vec![[0.5, 1.0, 2.0]; 2]);
    let file = workplace.output("lit.glb");
    let options = "--env-scale 3 --env-rotate -90 --aperture-radius 0.1";
    run(["export", "furnace", &file, "--env", &sky].into_iter().chain(options.split(' '))).says(&[
        "lit.env.exr",
        "--env-scale 3 --env-rotate -90",
        "no lens",
    ]);
    assert_eq!(workplace.outputs(), ["lit.env.exr", "lit.glb"]);
    let beside = workplace.output("lit.env.exr");
    assert_eq!(read_exr(Path::new(&beside)).unwrap(), read_exr(Path::new(&sky)).unwrap());
    assert_eq!(Scene::load(&file).unwrap().camera.unwrap().lens_radius, 0.1);
}

#[test]
fn an_export_that_cannot_be_written_leaves_nothing() {
    let workplace = Workplace::new();
    let refused = |scene: &str, file: &str, words: &[&str]| {
        run(["export", scene, &workplace.output(file)]).refused(words);
        assert_eq!(workplace.outputs(), [""; 0]);
    };
    refused("cornell", "scene.gltf", &[".glb"]);
    refused("cornell", "missing/scene.glb", &["cannot write", "missing"]);
    refused("teapot", "scene.glb", &["teapot", "cornell"]);
}

#[test]
fn a_picture_says_what_it_was_lit_by_and_seen_through() {
    let workplace = Workplace::new();
    let sky = sky(&workplace, "sky.exr", vec![[1.0; 3]; 4]);
    let seen = |more: &[&str]| {
        workplace.picture("image.exr", "cornell", more);
        let metadata = read_exr_metadata(Path::new(&workplace.output("image.exr"))).unwrap();
        ["environment", "lens"].map(|key| metadata.iter().find(|(name, _)| name == key).unwrap().1.clone())
    };
    let flags = ["--env", &sky, "--env-scale", "0.5", "--aperture-radius", "0.25", "--focus-distance", "3"];
    let [environment, lens] = seen(&flags);
    assert!(environment.ends_with("sky.exr, scale 0.5, turned 0 degrees"), "{environment}");
    assert_eq!(lens, "radius 0.25, sharp at 3");
    assert_eq!(seen(&[]), ["none", "pinhole"]);
}

#[test]
fn environments_that_cannot_be_used() {
    let workplace = Workplace::new();
    let good = sky(&workplace, "sky.exr", vec![[1.0; 3]; 2]);
    let nan = sky(&workplace, "nan.exr", vec![[1.0; 3], [1.0, f32::NAN, 1.0]]);
    let text = workplace.input("text.exr", b"no image");
    let refused = |flags: &[&str], words: &[&str]| assert_options_refused(&workplace, flags, words);
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
    let outcome = finish(&mut workplace.render("image.exr", "cornell", &["--env", &sky, "--spp", "1"])).done();
    assert!(outcome.stderr.contains("1 of its pixels are negative"), "{}", outcome.stderr);
}

#[test]
fn lenses_that_cannot_be_used() {
    let workplace = Workplace::new();
    for radius in ["-1", "nan", "1e30"] {
        assert_options_refused(&workplace, &["--aperture-radius", radius], &["lens radius"]);
    }
    for distance in ["0", "-1", "nan", "inf"] {
        let lens = ["--aperture-radius", "0.1", "--focus-distance", distance];
        assert_options_refused(&workplace, &lens, &["focus distance"]);
    }
    assert_options_refused(&workplace, &["--focus-distance", "1"], &["--aperture-radius"]);
}

/// A triangle with a texture of two by one texels, a point light, and its bytes.
pub(crate) fn textured() -> (Value, Vec<u8>) {
    textured_by(2, 1)
}

/// As [`textured`], with other numbers of texels; they are grey.
fn textured_by(width: u32, height: u32) -> (Value, Vec<u8>) {
    let (mut document, mut bytes) = triangles(&TRIANGLE);
    let mut image = Vec::new();
    let mut writer = png::Encoder::new(&mut image, width, height).write_header().unwrap();
    writer.write_image_data(&vec![127; (width * height) as usize]).unwrap();
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
    let stdout = run(["info", &Workplace::new().scene(&textured())]).done().stdout;
    for (row, end) in [("textures", "1 with 2 texels"), ("lights", "0 triangles, 1 point"), ("environment", "none")] {
        let line = stdout.lines().find(|line| line.starts_with(row)).unwrap();
        assert!(line.ends_with(end), "{line}");
    }
    assert!(!stdout.contains("warning"), "{stdout}");
}

#[test]
fn textures_beyond_the_memory_are_refused() {
    let mut scene = textured_by(1024, 1024);
    let image = scene.0["images"][0].clone();
    scene.0["images"].as_array_mut().unwrap().push(image);
    scene.0["textures"] = json!([{ "source": 0 }, { "source": 1 }]);
    scene.0["materials"][0]["emissiveTexture"] = json!({ "index": 1 });
    let workplace = Workplace::new();
    let mut command = program(["info", &workplace.scene(&scene)]);
    // decoding takes 16 bytes a texel of one of them, holding both 24
    let limited = |command: &mut std::process::Command, mebibytes: u32| {
        finish(command.env("RESTIR_MEMORY_LIMIT_BYTES", (mebibytes << 20).to_string()))
    };
    limited(&mut command, 22).refused(&["the textures of scene", "smaller ones"]);
    limited(&mut command, 32).done();
}

#[test]
fn broken_textures_are_refused() {
    let workplace = Workplace::new();
    let refused = |change: fn(&mut Value), words: &[&str]| {
        let mut scene = textured();
        change(&mut scene.0);
        run(["info", &workplace.scene(&scene)]).refused(words);
    };
    refused(|d| d["images"][0]["bufferView"] = json!(1), &["stripes", "neither a PNG nor a JPEG"]);
    refused(|d| d["images"][0]["bufferView"] = json!(9), &["stripes", "buffer view 9"]);
    refused(|d| d["bufferViews"][2]["byteLength"] = json!(50), &["stripes", "PNG"]);
    refused(|d| d["images"][0] = json!({ "uri": "missing.jpg" }), &["cannot read", "missing.jpg"]);
    refused(|d| d["textures"][0]["source"] = json!(5), &["texture 0", "no PNG or JPEG"]);
    refused(|d| d["accessors"][1]["count"] = json!(2), &["shape", "texture coordinates for 2"]);
    refused(|d| d["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = json!(3), &["light 3"]);
}
