//! Whether parts give an image: each pixel has each sample once.

use super::file::PartFile;
use super::header::{Tile, Unit};
use crate::Error;

/// A rectangle, and the parts that have its pixels, in the order of their ranges.
#[derive(Debug)]
pub(super) struct Cell<'a> {
    pub(super) rectangle: Tile,
    pub(super) parts: Vec<&'a PartFile>,
}

/// The rectangles into which the edges of all tiles cut the image, and how many samples there are.
///
/// # Errors
/// [`Error::Setting`] and [`Error::File`] that name the parts which do not go together, and what is missing.
pub(super) fn cells(parts: &[PartFile]) -> Result<(Vec<Cell<'_>>, u32), Error> {
    let Some((first, others)) = parts.split_first() else {
        return Err(Error::Setting("no part was given; name the files of all parts".to_owned()));
    };
    for part in others {
        if let Some(problem) = part.header().differs(first.header(), &first.path().display().to_string()) {
            return Err(cannot_merge(part, format!("it {problem}; merge parts of one render")));
        }
    }
    let header = first.header();
    let count = parts.iter().map(|part| part.header().count.max(part.header().range.end)).max().unwrap_or(0);
    let [columns, rows] = [0, 1].map(|axis| cuts(parts, axis, header.size[axis]));
    let mut cells = Vec::new();
    for row in rows.windows(2) {
        for column in columns.windows(2) {
            let (x, y) = (column[0], row[0]);
            let rectangle = Tile { x, y, width: column[1] - x, height: row[1] - y };
            let mut parts: Vec<_> = parts.iter().filter(|part| part.header().tile.has(rectangle)).collect();
            parts.sort_by_key(|part| part.header().range.start);
            check(&parts, header.unit, rectangle, header.size, count)?;
            cells.push(Cell { rectangle, parts });
        }
    }
    Ok((cells, count))
}

/// The columns or the rows at which some tile begins or ends.
fn cuts(parts: &[PartFile], axis: usize, size: u32) -> Vec<u32> {
    let ends = |tile: Tile| [[tile.x, tile.y][axis], tile.end()[axis]];
    let mut cuts: Vec<u32> = parts.iter().flat_map(|part| ends(part.header().tile)).chain([0, size]).collect();
    cuts.sort_unstable();
    cuts.dedup();
    cuts
}

/// Whether the ranges follow each other from 0 to `count`.
fn check(parts: &[&PartFile], unit: Unit, rectangle: Tile, size: [u32; 2], count: u32) -> Result<(), Error> {
    let place = if rectangle == Tile::whole(size) { String::new() } else { format!(" --tile {rectangle}") };
    let missing = |from: u32, to: u32| {
        let (name, to) = (unit.name(), to - 1);
        Err(Error::Setting(format!("{name} are missing; render --{name} {from}..{to}{place}, too")))
    };
    let mut last: Option<&PartFile> = None;
    for part in parts {
        let (end, range) = (last.map_or(0, |last| last.header().range.end), &part.header().range);
        match last {
            Some(last) if range.start < end => {
                let to = range.end.min(end) - 1;
                let (other, name, from) = (last.path().display(), unit.name(), range.start);
                let problem = match last.path() == part.path() {
                    true => "it is given twice; name each part once".to_owned(),
                    false => format!("{other} has --{name} {from}..{to}{place}, too; leave one of them out"),
                };
                return Err(cannot_merge(part, problem));
            }
            _ if range.start > end => return missing(end, range.start),
            _ => last = Some(part),
        }
    }
    let end = last.map_or(0, |last| last.header().range.end);
    if end < count { missing(end, count) } else { Ok(()) }
}

fn cannot_merge(part: &PartFile, problem: String) -> Error {
    Error::File { action: "merge", path: part.path().to_owned(), source: problem.into() }
}
