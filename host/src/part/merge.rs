//! Parts become an image.

use super::cover::{Cell, cells};
use super::file::PartFile;
use super::header::Unit;
use super::tree::Tree;
use crate::Error;
use crate::image::Image;
use restir_shared::layout::FilmPixel;

/// An image that was merged of parts.
#[derive(Clone, Debug)]
pub struct Merged {
    /// Mean radiance: the bits of one render.
    pub image: Image,
    /// What the parts count.
    pub unit: Unit,
    /// How many of them the image is the mean of.
    pub count: u32,
    /// How many dispatches all parts took.
    pub dispatches: u64,
    /// How many samples were dropped because they were not finite or a device cut them short.
    pub dropped_samples: u64,
    /// What else the technique has counted, by name.
    pub counts: Vec<(String, u64)>,
}

/// Merges parts of one image, given in any order.
///
/// # Errors
/// [`Error::Setting`] and [`Error::File`] that name the parts which are not of one render, have something in common, or lack something;
/// [`Error::File`] if one cannot be read.
pub fn merge(parts: &[PartFile]) -> Result<Merged, Error> {
    let (cells, count) = cells(parts)?;
    let (header, mut dropped_samples) = (parts[0].header(), 0);
    let [width, height] = header.size;
    let mut pixels = vec![[0.0; 3]; width as usize * height as usize];
    let bands = cells.iter().flat_map(|Cell { rectangle, parts }| rectangle.bands().map(move |band| (band, parts)));
    for (rectangle, parts) in bands {
        let mut tree = Tree::default();
        for part in parts {
            let blocks = part.header().blocks.iter().zip(part.read(rectangle)?);
            blocks.for_each(|(&(first, log2), sums)| tree.push(first, log2, sums));
        }
        let means: Vec<FilmPixel> = tree.sum().into_iter().map(|pixel| pixel.mean(count as f32)).collect();
        dropped_samples += means.iter().map(|pixel| pixel.dropped as u64).sum::<u64>();
        let rows = means.chunks_exact(rectangle.width as usize);
        for (y, row) in (rectangle.y..).zip(rows) {
            let at = y as usize * width as usize + rectangle.x as usize;
            pixels[at..at + row.len()].iter_mut().zip(row).for_each(|(pixel, mean)| *pixel = mean.sum);
        }
    }
    let mut counts: Vec<(String, u64)> = Vec::new();
    for (name, count) in parts.iter().flat_map(|part| &part.header().counts) {
        match counts.iter_mut().find(|(of, _)| of == name) {
            Some((_, sum)) => *sum += count,
            None => counts.push((name.clone(), *count)),
        }
    }
    let dispatches = parts.iter().map(|part| part.header().dispatches).sum();
    Ok(Merged { image: Image { width, height, pixels }, unit: header.unit, count, dispatches, dropped_samples, counts })
}
