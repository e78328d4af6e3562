//! Parts of an image that are rendered apart, on one machine or on many, and merged to the bits of one render.
//!
//! A film is a binary tree over the index of samples ([`restir_shared::film`]), and a sample is a function of its pixel and index. So a part
//! is some nodes of the tree: the sums of the aligned blocks that a range of samples consists of, of the pixels of a tile. Merging adds nodes that are siblings, and
//! needs no more arithmetic than the render itself.
//!
//! ```text
//! Portion ─> Part::render ─> blocks (first, log2) of FilmPixel ─> Part::write ─> file
//! files ─> PartFile::open ─> merge: are they of one render, and is nothing missing or there twice?
//!                            then, rectangle by rectangle, siblings are added and the sum is divided
//! ```
//!
//! What the index counts is the [`Unit`]: samples of path tracing, or, of techniques that reuse, whole chains of frames with seeds of their own, or
//! frames of one chain, whose state goes from part to part in a file.
//!
//! ```
//! use restir_host::part::{Part, PartFile, Portion, Unit, merge};
//! use restir_host::render::Render;
//! use restir_host::technique::path::PathSettings;
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 7, ..Render::new([16, 16], PathSettings::default()) };
//! let cpu = &mut CpuExecutor::new()?;
//! let folder = std::env::temp_dir();
//! let mut files = Vec::new();
//! for (name, range) in [("a", 0..5), ("b", 5..7)] {
//!     let path = folder.join(format!("restir-{name}-{}.part", std::process::id()));
//!     let portion = Portion { unit: Unit::Samples, range, tile: None };
//!     Part::render(cpu, &scene, &job, &portion, &mut |_| Ok(()))?.write(&path)?;
//!     files.push(PartFile::open(&path)?);
//! }
//! let merged = merge(&files)?;
//! assert_eq!(merged.image, job.render(&scene, cpu)?.image);
//! # files.iter().for_each(|file| std::fs::remove_file(file.path()).unwrap_or_default());
//! # Ok::<(), Error>(())
//! ```

mod cover;
mod file;
mod header;
mod make;
mod merge;
mod noise;
mod tree;

pub use file::PartFile;
pub use header::{Header, Tile, Unit};
pub use merge::{Merged, merge};
pub use noise::{Noise, noise};

use restir_shared::layout::FilmPixel;
use std::ops::Range;

/// What is to be rendered of an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Portion {
    /// What the range counts.
    pub unit: Unit,
    /// Which of them; not empty.
    pub range: Range<u32>,
    /// Which pixels; all if there is none. Of [`Unit::Samples`] alone.
    pub tile: Option<Tile>,
}

/// A part of an image: partial sums, and what it is a part of.
#[derive(Clone, Debug)]
pub struct Part {
    header: Header,
    /// The sums of the header's blocks, row by row.
    planes: Vec<Vec<FilmPixel>>,
}

impl Part {
    /// What it is a part of.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The same with remarks for who merges it, by key: they do not have to agree.
    #[must_use]
    pub fn with_notes(mut self, notes: Vec<(String, String)>) -> Self {
        self.header.notes = notes;
        self
    }
}
