//! What a part says of itself.

use crate::buffers::SceneBuffers;
use crate::checkpoint::{hash_code, hash_scene};
use crate::exec::Description;
use crate::image::MAX_SIDE;
use crate::render::Render;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;

/// So many pixels are merged at once: parts have a plane for each of their blocks.
const MOST_PIXELS: u32 = 1 << 20;

/// What the index of a part counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Samples of each pixel, of techniques that repeat samples.
    Samples,
    /// Chains of frames, each a render with a seed of its own: that of the render and so many more. The image is their mean.
    Chains,
    /// Frames of one chain. The image is their mean.
    Frames,
}

impl Unit {
    /// What they are called, which is also the option of the program that asks for them.
    pub fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Chains => "chains",
            Self::Frames => "frames",
        }
    }
}

/// A rectangle of pixels, written as `WIDTHxHEIGHT+X+Y`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tile {
    /// Column of its first pixels.
    pub x: u32,
    /// Row of its first pixels, from the top.
    pub y: u32,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

impl Tile {
    /// A whole image.
    pub fn whole([width, height]: [u32; 2]) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Whether it has pixels, and all of them are in the image.
    pub(super) fn is_in(self, [width, height]: [u32; 2]) -> bool {
        let fits = |from: u32, len: u32, of: u32| len > 0 && from.checked_add(len).is_some_and(|end| end <= of);
        fits(self.x, self.width, width) && fits(self.y, self.height, height)
    }

    /// Whether it has all pixels of the other one.
    pub(super) fn has(self, other: Self) -> bool {
        let [x, y] = self.end();
        let [other_x, other_y] = other.end();
        self.x <= other.x && self.y <= other.y && other_x <= x && other_y <= y
    }

    /// The column and the row behind its last ones.
    pub(super) fn end(self) -> [u32; 2] {
        [self.x + self.width, self.y + self.height]
    }

    /// The tile in bands of some rows, of which not more has to be held at once.
    pub(super) fn bands(self) -> impl Iterator<Item = Self> {
        let rows = (MOST_PIXELS / self.width.max(1)).max(1);
        let [_, end] = self.end();
        (self.y..end).step_by(rows as usize).map(move |y| Self { y, height: rows.min(end - y), ..self })
    }

    pub(super) fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }
}

impl fmt::Display for Tile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { x, y, width, height } = self;
        write!(f, "{width}x{height}+{x}+{y}")
    }
}

/// What a part is a part of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// What the range counts.
    pub unit: Unit,
    /// Which of them.
    pub range: Range<u32>,
    /// How many the image has at least.
    pub count: u32,
    /// Width and height of the image in pixels.
    pub size: [u32; 2],
    /// Which pixels.
    pub tile: Tile,
    /// All that decides on the bits beside the range and the tile, by name: parts that are merged agree in it.
    pub of: Vec<(String, String)>,
    /// Remarks of who has rendered it, by key.
    pub notes: Vec<(String, String)>,
    /// The blocks: the first index, and log2 of how many.
    pub(super) blocks: Vec<(u32, u32)>,
    /// How many dispatches it took.
    pub dispatches: u64,
    /// What else the technique has counted, by name.
    pub counts: Vec<(String, u64)>,
}

impl Header {
    /// Whether it is one that a render makes: a file may say anything.
    pub(super) fn is_sound(&self) -> bool {
        let mut next = u64::from(self.range.start);
        let contiguous = self.blocks.iter().all(|&(first, log2)| {
            let follows = u64::from(first) == next && log2 < u32::BITS && first.trailing_zeros() >= log2;
            next += if log2 < u32::BITS { 1 << log2 } else { 0 };
            follows
        });
        let is_image = self.size.iter().all(|&side| side <= MAX_SIDE) && self.tile.is_in(self.size);
        contiguous && next == u64::from(self.range.end) && !self.range.is_empty() && is_image
    }

    /// The first thing in which it is a part of something else than `other` is, whose name is given, as words that go on after "it".
    pub(super) fn differs(&self, other: &Self, name: &str) -> Option<String> {
        if self.unit != other.unit {
            return Some(format!("has {}, and {name} has {}", self.unit.name(), other.unit.name()));
        }
        let of =
            |header: &'_ Self, key: &str| header.of.iter().find(|(of, _)| of == key).map(|(_, value)| value.clone());
        let keys = self.of.iter().chain(&other.of).map(|(key, _)| key);
        let (key, values) =
            keys.map(|key| (key.as_str(), [of(self, key), of(other, key)])).find(|(_, [this, that])| this != that)?;
        if matches!(key, "version" | "scene" | "camera") {
            return Some(format!("is of another {key} than {name}"));
        }
        let [this, that] = values.map(|value| value.unwrap_or_else(|| "none".to_owned()));
        Some(format!("is of {key}={this}, and {name} of {key}={that}"))
    }
}

/// All that decides on the bits of a render beside which of them are made, by name, what matters most first.
pub(super) fn identity(
    scene: &SceneBuffers,
    render: &Render,
    unit: Unit,
    device: &Description,
) -> Vec<(String, String)> {
    let Render { width, height, count, accumulate, seed, cameras, technique, .. } = render;
    let hash = |fill: &dyn Fn(&mut blake3::Hasher)| {
        let mut hasher = blake3::Hasher::new();
        fill(&mut hasher);
        hasher.finalize().to_hex().to_string()
    };
    let camera = format!("{:?}", (cameras, scene.camera));
    let mut pairs = vec![
        ("version", hash(&|hasher| hash_code(hasher))),
        ("device", device.origin()),
        ("scene", hash(&|hasher| hash_scene(scene, hasher))),
        ("technique", technique.about().name.to_owned()),
        ("width", width.to_string()),
        ("height", height.to_string()),
        ("seed", seed.to_string()),
    ];
    if unit == Unit::Chains {
        pairs.extend([("frames", count.to_string()), ("accumulate", accumulate.to_string())]);
    }
    pairs.extend(technique.entries().into_iter().map(|entry| (entry.key, entry.value)));
    pairs.push(("camera", blake3::hash(camera.as_bytes()).to_hex().to_string()));
    pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}
