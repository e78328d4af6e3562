//! What is read is not written over.

use serde_json::json;

use crate::input_output::textured;
use crate::support::{Workplace, finish, run};

const WORDS: [&str; 2] = ["also read", "another file"];

/// A picture to be read, among the outputs.
fn sky(workplace: &Workplace, name: &str) -> String {
    finish(&mut workplace.render(name, "furnace", &["--spp", "1", "--size", "4x2"])).done();
    workplace.output(name)
}

#[test]
fn inputs_are_kept() {
    let workplace = Workplace::new();
    let (sky, scene) = (sky(&workplace, "sky.exr"), workplace.output("scene.glb"));
    run(["export", "cornell", &scene]).done();
    let before = [&sky, &scene].map(|path| std::fs::read(path).unwrap());
    finish(&mut workplace.render("sky.exr", "cornell", &["--env", &sky])).refused(&WORDS);
    run(["export", &scene, &scene]).refused(&WORDS);
    run(["reference", "cornell", "--env", &sky, "-o", &sky]).refused(&WORDS);
    assert_eq!([&sky, &scene].map(|path| std::fs::read(path).unwrap()), before);
    assert_eq!(workplace.outputs(), ["scene.glb", "sky.exr"]);
}

/// All frames are looked at before the first is rendered.
#[test]
fn no_frame_replaces_an_input_or_a_folder() {
    let workplace = Workplace::new();
    let sky = sky(&workplace, "out.05.exr");
    let before = std::fs::read(&sky).unwrap();
    let more = ["--env", &sky, "--spp", "1", "--frames", "0..9"];
    finish(&mut workplace.render("out.##.exr", "cornell", &more)).refused(&WORDS);
    assert_eq!((workplace.outputs(), std::fs::read(&sky).unwrap()), (vec!["out.05.exr".to_owned()], before));
    std::fs::create_dir(workplace.output("out.07.exr")).unwrap();
    let words = ["out.07.exr", "it is a folder"];
    finish(&mut workplace.render("out.##.exr", "cornell", &["--spp", "1", "--frames", "6..9"])).refused(&words);
    assert_eq!(workplace.outputs(), ["out.05.exr", "out.07.exr"]);
}

/// The environment goes to a second file, whose name is not asked for.
#[test]
fn the_environment_beside_an_export_is_a_file_to_be_written() {
    let workplace = Workplace::new();
    let (sky, scene) = (sky(&workplace, "a.env.exr"), workplace.output("a.glb"));
    let before = std::fs::read(&sky).unwrap();
    run(["export", "cornell", &scene, "--env", &sky]).refused(&WORDS);
    assert_eq!((workplace.outputs(), std::fs::read(&sky).unwrap()), (vec!["a.env.exr".to_owned()], before));
    std::fs::create_dir(workplace.output("b.env.exr")).unwrap();
    run(["export", "cornell", &workplace.output("b.glb"), "--env", &sky]).refused(&["b.env.exr", "it is a folder"]);
    assert_eq!(workplace.outputs(), ["a.env.exr", "b.env.exr"]);
}

/// What a document refers to is read as it is itself.
#[test]
fn buffers_and_images_of_a_document_are_kept() {
    let workplace = Workplace::new();
    let (mut document, data) = textured();
    let view = |index: usize, key: &str| document["bufferViews"][index][key].as_u64().unwrap_or(0) as usize;
    let image = data[view(2, "byteOffset")..][..view(2, "byteLength")].to_vec();
    document["images"] = json!([{ "uri": "bits%20of.png" }]);
    document["buffers"][0]["uri"] = json!("data.glb");
    let [image, data] = [("bits of.png", image), ("data.glb", data)].map(|(name, bytes)| workplace.input(name, &bytes));
    let scene = workplace.input("scene.gltf", document.to_string().as_bytes());
    let before = [&image, &data].map(|path| std::fs::read(path).unwrap());
    let more = ["--spp", "1", "--png", &image];
    finish(&mut workplace.render("image.exr", &scene, &more)).refused(&WORDS);
    run(["export", &scene, &data]).refused(&WORDS);
    assert_eq!([&image, &data].map(|path| std::fs::read(path).unwrap()), before);
    assert_eq!(workplace.outputs(), [""; 0]);
}
