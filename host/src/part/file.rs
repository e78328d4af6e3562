//! Parts in files.

use super::Part;
use super::header::{Header, Tile};
use crate::Error;
use crate::output::write_hashed;
use restir_shared::layout::FilmPixel;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// The file begins with this and the length of the header as 8 bytes; the header is JSON; then come the planes of the blocks, four 32-bit numbers a
/// pixel, least byte first, and a hash (BLAKE3) of all that.
const MAGIC: &[u8; 14] = b"restir part 1\n";
const HASH: u64 = blake3::OUT_LEN as u64;
/// Longer headers are none of ours.
const MOST_HEADER: u64 = 1 << 24;
const PIXEL: u64 = size_of::<FilmPixel>() as u64;

impl Part {
    /// Writes it to a file, whole or not at all.
    ///
    /// # Errors
    /// [`Error::File`] if that cannot be.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let header = serde_json::to_vec(&self.header).map_err(|error| Error::cannot_write(path, error))?;
        write_hashed(path, |put| {
            put(MAGIC)?;
            put(&(header.len() as u64).to_le_bytes())?;
            put(&header)?;
            self.planes.iter().try_for_each(|plane| put(bytemuck::cast_slice(plane)))
        })
    }
}

/// A part in a file that was found whole. Its pixels are read when they are merged.
#[derive(Clone, Debug)]
pub struct PartFile {
    path: PathBuf,
    header: Header,
    /// Where the first plane begins.
    start: u64,
}

impl PartFile {
    /// Reads what a part says of itself, and checks that the file is whole.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be read, is no part, or is damaged.
    pub fn open(path: &Path) -> Result<Self, Error> {
        Self::checked(path).map_err(|error| match error.kind() {
            io::ErrorKind::InvalidInput => Error::cannot_read(
                path,
                "it is no part of an image; name files that restir render --samples or --tile writes",
            ),
            io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => {
                Error::cannot_read(path, "it is no whole part of an image; render it again")
            }
            _ => Error::cannot_read(path, error),
        })
    }

    fn checked(path: &Path) -> io::Result<Self> {
        let damaged = || io::Error::from(io::ErrorKind::InvalidData);
        // to open a pipe would wait for who writes it
        let is_file = std::fs::metadata(path)?.is_file();
        let file = if is_file { File::open(path)? } else { return Err(io::ErrorKind::InvalidInput.into()) };
        let whole = file.metadata()?.len();
        let mut hashed = Hashed { file: BufReader::with_capacity(1 << 20, file), hasher: blake3::Hasher::new() };
        let (mut magic, mut length) = ([0; MAGIC.len()], [0; 8]);
        hashed.read_exact(&mut magic)?;
        if magic != *MAGIC {
            return Err(io::ErrorKind::InvalidInput.into());
        }
        hashed.read_exact(&mut length)?;
        let length = u64::from_le_bytes(length);
        if length > MOST_HEADER {
            return Err(damaged());
        }
        let mut header = vec![0; length as usize];
        hashed.read_exact(&mut header)?;
        let header: Header = serde_json::from_slice(&header).map_err(|_| damaged())?;
        if !header.is_sound() {
            return Err(damaged());
        }
        let start = MAGIC.len() as u64 + 8 + length;
        let planes = header.blocks.len() as u64 * header.tile.pixels() as u64 * PIXEL;
        if whole != start + planes + HASH {
            return Err(damaged());
        }
        io::copy(&mut (&mut hashed).take(planes), &mut io::sink())?;
        let found = hashed.hasher.finalize();
        let mut hash = [0; HASH as usize];
        hashed.read_exact(&mut hash)?;
        if found == hash { Ok(Self { path: path.to_owned(), header, start }) } else { Err(damaged()) }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What it is a part of.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The sums of all blocks over a rectangle that its tile has.
    pub(super) fn read(&self, rectangle: Tile) -> Result<Vec<Vec<FilmPixel>>, Error> {
        self.planes(rectangle).map_err(|error| Error::cannot_read(&self.path, error))
    }

    fn planes(&self, rectangle: Tile) -> io::Result<Vec<Vec<FilmPixel>>> {
        let tile = self.header.tile;
        let mut file = File::open(&self.path)?;
        let mut plane = |index: u64| {
            let mut pixels = vec![FilmPixel::default(); rectangle.pixels()];
            let rows = pixels.chunks_exact_mut(rectangle.width as usize);
            for (row, pixels) in (u64::from(rectangle.y - tile.y)..).zip(rows) {
                let before =
                    index * tile.pixels() as u64 + row * u64::from(tile.width) + u64::from(rectangle.x - tile.x);
                file.seek(SeekFrom::Start(self.start + before * PIXEL))?;
                file.read_exact(bytemuck::cast_slice_mut(pixels))?;
            }
            Ok(pixels)
        };
        (0..self.header.blocks.len() as u64).map(&mut plane).collect()
    }
}

/// Hashes what is read.
struct Hashed {
    file: BufReader<File>,
    hasher: blake3::Hasher,
}

impl Read for Hashed {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.file.read(buffer)?;
        self.hasher.update(&buffer[..read]);
        Ok(read)
    }
}
