//! Running a program and making small glTF files. The suite of the laboratory has this file, too.

use std::ffi::OsStr;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use restir::image::{Image, read_exr, write_exr};
use serde_json::{Value, json};
use tempfile::TempDir;

/// What a run of the program left behind.
pub(crate) struct Outcome {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Outcome {
    /// The run worked.
    #[track_caller]
    pub(crate) fn done(self) -> Self {
        assert_eq!(self.code, Some(0), "{}", self.stderr);
        assert!(!self.stderr.contains("error"), "{}", self.stderr);
        self
    }

    /// The run worked; its words may be those of a file.
    #[track_caller]
    pub(crate) fn done_whatever_it_says(self) -> Self {
        assert_eq!(self.code, Some(0), "{}", self.stderr);
        self
    }

    /// The run worked and printed all of `words`.
    #[track_caller]
    pub(crate) fn says(self, words: &[&str]) -> Self {
        for word in words {
            assert!(self.stdout.contains(word), "{word} is not in:\n{}", self.stdout);
        }
        self.done()
    }

    /// The run worked and printed this.
    #[track_caller]
    pub(crate) fn json(self) -> Value {
        serde_json::from_str(&self.done().stdout).unwrap()
    }

    /// The run is refused: exit code 2 and one line that explains it with all of `words`.
    #[track_caller]
    pub(crate) fn refused(self, words: &[&str]) -> Self {
        assert_eq!(self.code, Some(2), "{}", self.stderr);
        let errors: Vec<&str> = self.stderr.lines().filter(|line| line.starts_with("error:")).collect();
        let [error] = errors[..] else { panic!("not one line of error:\n{}", self.stderr) };
        assert_eq!(self.stderr.lines().last(), Some(error), "the error comes last");
        for word in words {
            assert!(error.contains(word), "{word} is not in: {error}");
        }
        self
    }
}

/// A folder for inputs beside an empty one for outputs.
pub(crate) struct Workplace {
    folder: TempDir,
}

impl Workplace {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("out")).unwrap();
        Self { folder }
    }

    /// Writes an input file and gives its path as an argument.
    pub(crate) fn input(&self, name: &str, bytes: &[u8]) -> String {
        let path = self.folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path.to_str().unwrap().to_owned()
    }

    /// As [`Self::input`], of a glTF document with the bytes that it refers to.
    pub(crate) fn scene(&self, scene: &(Value, Vec<u8>)) -> String {
        self.input("scene.glb", &glb(scene))
    }

    /// Path of an output as an argument.
    pub(crate) fn output(&self, name: &str) -> String {
        self.output_folder().join(name).to_str().unwrap().to_owned()
    }

    /// Names of the files in the folder for outputs.
    pub(crate) fn outputs(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.output_folder()).unwrap();
        let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn output_folder(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    /// Renders `scene` to the output `name`: on the CPU, at 16x12 pixels, unless `more` says otherwise.
    pub(crate) fn render(&self, name: &str, scene: &str, more: &[&str]) -> Command {
        let command = program(["render", scene, "-o", &self.output(name)]);
        with_defaults(command, &[["--device", "cpu"], ["--size", "16x12"]], more)
    }

    /// The picture that [`Self::render`] makes.
    pub(crate) fn picture(&self, name: &str, scene: &str, more: &[&str]) -> Image {
        finish(&mut self.render(name, scene, more)).done();
        read_exr(Path::new(&self.output(name))).unwrap()
    }

    /// The command is refused, and leaves no output.
    #[track_caller]
    pub(crate) fn refuses(&self, command: &mut Command, words: &[&str]) {
        finish(command).refused(words);
        assert_eq!(self.outputs(), [""; 0]);
    }
}

/// The suite's program, with arguments.
pub(crate) fn program<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(crate::PROGRAM);
    command.args(arguments).env_remove("RESTIR_MEMORY_LIMIT_BYTES");
    command
}

/// Adds those of `defaults` that are not given in `more`, and `more`.
pub(crate) fn with_defaults(mut command: Command, defaults: &[[&str; 2]], more: &[&str]) -> Command {
    command.args(defaults.iter().filter(|[name, _]| !more.contains(name)).flatten()).args(more);
    command
}

pub(crate) fn finish(command: &mut Command) -> Outcome {
    let output = command.output().unwrap();
    let [stdout, stderr] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(!stderr.contains("panicked"), "{stderr}");
    Outcome { code: output.status.code(), stdout, stderr }
}

pub(crate) fn run<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Outcome {
    finish(&mut program(arguments))
}

/// The value of a key of an image's metadata.
pub(crate) fn value_of<'a>(metadata: &'a [(String, String)], key: &str) -> Option<&'a str> {
    metadata.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str())
}

/// A document with one mesh of separate triangles, three positions each, and the bytes it refers to.
pub(crate) fn triangles(positions: &[[f32; 3]]) -> (Value, Vec<u8>) {
    let bytes: Vec<u8> = positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "name": "shape", "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
        "materials": [{ "name": "grey", "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicFactor": 0.0 } }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": positions.len(), "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
        "buffers": [{ "byteLength": bytes.len() }],
    });
    (document, bytes)
}

/// [`TRIANGLE`] in a document that was changed.
pub(crate) fn changed(change: impl FnOnce(&mut Value)) -> (Value, Vec<u8>) {
    let (mut document, bytes) = triangles(&TRIANGLE);
    change(&mut document);
    (document, bytes)
}

/// A binary glTF file.
pub(crate) fn glb((document, bytes): &(Value, Vec<u8>)) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |length: usize| (length as u32).to_le_bytes();
    let length = 12 + 8 + text.len() + 8 + bytes.len();
    let header = [*b"glTF", word(2), word(length), word(text.len()), *b"JSON"];
    [header.as_flattened(), &text, &word(bytes.len()), b"BIN\0", bytes].concat()
}

/// A black EXR file of so many pixels on a side, a multiple of 16: one with a single block of rows, whose block is repeated.
pub(crate) fn zeros(side: u32) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rows.exr");
    write_exr(&path, &Image { width: side, height: 16, pixels: vec![[0.0; 3]; 16 * side as usize] }, &[]).unwrap();
    let rows = std::fs::read(path).unwrap();
    let number = |at: usize| u64::from_le_bytes(rows[at..at + 8].try_into().unwrap());
    // the header ends with the offset of the only block, which comes next
    let end = (8..rows.len() - 8).find(|&at| number(at) == at as u64 + 8).unwrap();
    let (mut header, block) = (rows[..end].to_vec(), &rows[end + 8..]);
    let corner = |bottom: u32| [(side - 1).to_le_bytes(), bottom.to_le_bytes()].concat();
    while let Some(at) = header.windows(8).position(|window| window == corner(15)) {
        header[at..at + 8].copy_from_slice(&corner(side - 1));
    }
    let blocks = (side / 16) as usize;
    let first = header.len() + 8 * blocks;
    let offsets = (0..blocks).flat_map(|i| ((first + i * block.len()) as u64).to_le_bytes());
    let repeated = (0..side).step_by(16).flat_map(|y| [&y.to_le_bytes(), &block[4..]].concat());
    header.iter().copied().chain(offsets).chain(repeated).collect()
}

/// A triangle in the plane z = 0, facing +z.
pub(crate) const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// Says on standard error why a test is skipped: not by `eprintln!`, which the test harness hides.
pub(crate) fn skipped(why: &str) {
    let _ = writeln!(std::io::stderr(), "skipped: {why}");
}
