//! Small files of the kinds that users of comparable software reported as coming out wrong, each with what is right.

use crate::gltf_files::{File, LINEAR, REPEAT, bumps, colors, lamp, metallic_roughness, sampler, translucent};
use serde_json::{Value, json};

mod fine;
mod seams;
mod sets;
mod unread;

/// A binary glTF file and what is right of it.
#[derive(Debug)]
pub struct Reported {
    /// What it is about.
    pub name: String,
    /// Its bytes.
    pub file: Vec<u8>,
    /// What becomes of it.
    pub right: Right,
}

/// What becomes of a file.
#[derive(Debug)]
pub enum Right {
    /// It is read without a warning.
    Silence,
    /// It is read, with a warning that has these words.
    Warning(String),
    /// It is refused, by a sentence that has these words.
    Refusal(String),
    /// It is read without a warning, and its picture is that of another file.
    Picture {
        /// The other file.
        same: Vec<u8>,
        /// A file that a reader with the reported fault would take it for: its picture is another one.
        wrong: Vec<u8>,
        /// The most that pictures may differ by, relative to their sum; 0 is every bit.
        within: f64,
    },
}

/// All of them.
pub fn files() -> Vec<Reported> {
    [sets::files(), fine::files(), unread::files(), seams::files()].into_iter().flatten().collect()
}

/// The textures that subjects use, by their numbers.
const COLORS: usize = 0;
const METALLIC_ROUGHNESS: usize = 1;
const BUMPS: usize = 2;
const TRANSLUCENT: usize = 3;

/// A stage of a material, with those textures.
fn stage(subject: Value) -> File {
    let mut file = File::stage(json!([subject, lamp()]));
    for image in [colors(), metallic_roughness(), bumps(), translucent()] {
        file.texture(&image, sampler(LINEAR, [REPEAT; 2]));
    }
    file
}
