//! What is mutated: small files of every kind that the program reads, each with the commands that read it.

use std::path::Path;
use std::time::Duration;

use base64::Engine;
use restir::advanced::checkpoint::{Checkpoint, render_resumed};
use restir::buffers::SceneBuffers;
use restir::exec::CpuExecutor;
use restir::image::{Image, write_exr, write_png};
use restir::render::Render;
use restir::scene::Scene;
use restir::technique::path::PathSettings;
use restir::{Error, technique};
use serde_json::{Value, json};

use super::arguments;
use super::mutate::{self, Dice};
use super::trial::Case;
use crate::input_output::textured;
use crate::motion::moving_files;
use crate::support::{glb, run};

/// Changes a file.
type Mutate = fn(&mut Dice, Vec<u8>) -> Vec<u8>;

/// Files of a kind, and what reads them. In a command `@` is the file that is changed, `%` stands before an output, and `$` before
/// another input.
struct Subject {
    /// Its names: more than one file may be needed, of which the first is changed.
    files: Vec<(String, Vec<u8>)>,
    mutators: &'static [Mutate],
    commands: &'static [&'static str],
}

pub(super) struct Corpus {
    subjects: Vec<Subject>,
}

/// The rest of what a render needs, fast.
const SCENE_COMMANDS: &[&str] = &[
    "info @",
    "render @ -o %a.exr --png %a.png --size 4x3 --spp 1 --default-light --device cpu --threads 1",
    "render @ -o %a.exr --size 4x3 --spp 2 --time 0.3 --emitters 3 --aov albedo,normal,depth,position,motion,id --device cpu --threads 1",
    "render @ -o %a.exr --size 4x3 --technique restir-di --frames 2 --default-light --layers --device cpu --threads 1",
    "render @ -o %a.exr --size 4x3 --technique restir-pt --frames 2 --default-light --layers --device cpu --threads 1",
    "render @ -o %a.exr --size 4x3 --spp 1 --subsurface wax --set subsurface=hybrid --aov scattering --default-light --device cpu --threads 1",
    "render @ -o %a.exr --size 4x3 --spp 1 --subsurface 0.9,0.5,0.2:0.1 --max-depth 64 --default-light --device cpu --threads 1",
    "render @ -o %a#.exr --size 4x3 --spp 1 --turntable 2 --default-light --device cpu --threads 1",
    "explain @ --technique restir-pt --frames 2 --pixel 1,1 --size 4x3 --default-light --device cpu --threads 1",
    "export @ %b.glb --default-light",
];

impl Corpus {
    pub(super) fn new() -> Self {
        let mut subjects = vec![arguments_of_nothing(), environments(), camera_paths()];
        let mut scenes = moving_files().to_vec();
        scenes.push(glb(&textured()));
        scenes.extend(["cornell", "moving", "foliage", "candles", "glass", "slab"].map(exported));
        subjects.extend(scenes.iter().map(|scene| Subject {
            files: vec![("in.glb".to_owned(), scene.clone())],
            mutators: &[mutate::glb_file, mutate::glb_file, mutate::glb_file, mutate::bytes],
            commands: SCENE_COMMANDS,
        }));
        subjects.push(text_scene());
        subjects.extend(images());
        subjects.extend([checkpoint(), reference()]);
        Self { subjects }
    }

    /// One of many.
    pub(super) fn case(&self, dice: &mut Dice) -> Case {
        let subject = dice.of(&self.subjects);
        let mut files = subject.files.clone();
        if let Some((_, bytes)) = files.first_mut() {
            let mutate = dice.of(subject.mutators);
            *bytes = mutate(dice, std::mem::take(bytes));
        }
        let command = dice.of(subject.commands).split(' ').map(str::to_owned).collect();
        // of arguments there is nothing else to change
        let command =
            if subject.files.is_empty() || dice.one_in(16) { arguments::mutated(dice, command) } else { command };
        let file = files.first().map_or_else(String::new, |(name, _)| name.clone());
        Case { files, file, command, interrupted: dice.one_in(20).then(|| Duration::from_micros(dice.word() % 10_000)) }
    }
}

fn arguments_of_nothing() -> Subject {
    Subject { files: Vec::new(), mutators: &[], commands: arguments::COMMANDS }
}

fn exported(scene: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.glb");
    run(["export", scene, file.to_str().unwrap()]).done();
    std::fs::read(file).unwrap()
}

/// The bytes of an image.
fn encoded(write: impl FnOnce(&Path, &Image) -> Result<(), Error>) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("image");
    let pixels = (0..8 * 4_u8).map(|i| [f32::from(i), 0.5, 1.0e-3 * f32::from(i)]).collect();
    write(&file, &Image { width: 8, height: 4, pixels }).unwrap();
    std::fs::read(file).unwrap()
}

fn environments() -> Subject {
    let pairs = [("scene".to_owned(), "none".to_owned())];
    let sky = encoded(|path, image| write_exr(path, image, &pairs));
    Subject {
        files: vec![("in.exr".to_owned(), sky.clone()), ("other.exr".to_owned(), sky)],
        mutators: &[mutate::bytes],
        commands: &[
            "render cornell --env @ -o %a.exr --size 4x3 --spp 1 --device cpu --threads 1",
            "compare @ $other.exr",
            "compare $other.exr @ --json",
            "info @",
            "export cornell %b.glb --env @ --env-scale 2",
        ],
    }
}

fn camera_paths() -> Subject {
    let key = |frame: u32, x: f64| json!({ "frame": frame, "position": [x, 1, 4], "target": [0, 1, 0], "fov": 40 });
    let path = json!([key(0, 0.0), key(3, 1.0), key(9, 2.5)]);
    Subject {
        files: vec![("in.json".to_owned(), path.to_string().into_bytes())],
        mutators: &[mutate::json_text, mutate::bytes],
        commands: &[
            "render cornell -o %a.exr --technique restir-di --frames 3 --camera-path @ --size 4x3 --device cpu --threads 1",
            "render cornell -o %a#.exr --frames 1..2 --spp 1 --camera-path @ --size 4x3 --aov motion --device cpu --threads 1",
        ],
    }
}

/// A document with its data beside it, in itself, and in an image.
fn text_scene() -> Subject {
    let (mut document, data) = textured();
    let encoded = base64::engine::general_purpose::STANDARD.encode(data);
    document["buffers"][0]["uri"] = Value::from(format!("data:application/octet-stream;base64,{encoded}"));
    Subject {
        files: vec![("in.gltf".to_owned(), document.to_string().into_bytes())],
        mutators: &[mutate::json_text, mutate::json_text, mutate::bytes],
        commands: SCENE_COMMANDS,
    }
}

/// Images of textures. The JPEG files are those of the library's tests, which are here as long as nobody takes this suite out of the
/// repository: no package holds either.
fn images() -> Vec<Subject> {
    let png = encoded(write_png);
    let jpeg = include_bytes!("../../../../src/scene/gltf/tests/files/checker.jpg").to_vec();
    let progressive = include_bytes!("../../../../src/scene/gltf/tests/files/checker-progressive-420.jpg").to_vec();
    let of = |(name, image): (&str, Vec<u8>)| {
        let (mut document, data) = textured();
        document["images"] = json!([{ "uri": name }]);
        document["buffers"][0]["uri"] = json!("data.bin");
        let files = [(name, image), ("scene.gltf", document.to_string().into_bytes()), ("data.bin", data)];
        Subject {
            files: files.map(|(name, bytes)| (name.to_owned(), bytes)).to_vec(),
            mutators: &[mutate::bytes],
            commands: &[
                "info $scene.gltf",
                "render $scene.gltf -o %a.exr --size 4x3 --spp 1 --device cpu --threads 1",
                "export $scene.gltf %b.glb",
            ],
        }
    };
    [("in.png", png), ("in.jpg", jpeg), ("in.jpg", progressive)].map(of).into()
}

/// What a render that was interrupted in its second pass has kept.
fn checkpoint() -> Subject {
    let folder = tempfile::tempdir().unwrap();
    let path = &folder.path().join("kept");
    let scene = Scene::load("cornell").unwrap();
    let buffers = SceneBuffers::build(&scene).unwrap();
    let mut settings = technique::named("path").unwrap();
    settings.set("dispatch_samples", "1").unwrap();
    assert!(PathSettings::default().jitter, "as of the command below");
    let render = Render { count: 4, ..Render::new([4, 3], settings) };
    let checkpoint = Checkpoint { path, every: Duration::MAX };
    let mut cpu = CpuExecutor::inline();
    let second = |done: u64| if done == 2 { Err(Error::Interrupted) } else { Ok(()) };
    render_resumed(&mut cpu, &buffers, &render, checkpoint, &mut |step| second(step.progress.done)).unwrap_err();
    Subject {
        files: vec![("in.part".to_owned(), std::fs::read(path).unwrap())],
        mutators: &[mutate::bytes],
        commands: &[
            "render cornell -o %a.exr --size 4x3 --spp 4 --set dispatch_samples=1 --resume @ --device cpu --threads 1",
        ],
    }
}

/// Half of a reference, in the folder of its cache.
fn reference() -> Subject {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().to_str().unwrap();
    run("reference cornell --size 4x3 --spp 128 --device cpu --threads 1 --cache".split(' ').chain([cache])).done();
    let entry = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap();
    let named = |name: &str| {
        let bytes = std::fs::read(entry.path().join(name)).unwrap();
        (format!("cache/{}/{name}", entry.file_name().to_str().unwrap()), bytes)
    };
    Subject {
        files: vec![named("half0.exr"), named("half1.exr")],
        mutators: &[mutate::bytes],
        commands: &[
            "reference cornell --size 4x3 --spp 128 --cache $cache -o %a.exr --error %b.exr --device cpu --threads 1",
        ],
    }
}
