//! One side of a comparison: moments over restarts, kept in a file.

use std::path::Path;

use rayon::prelude::*;
use restir_host::output::write_atomically;
use restir_tests::stats::Moments;
use serde::{Deserialize, Serialize};

use super::GRID;
use crate::Error;

/// Restarts between two writes of the state.
const ROUND: u32 = 256;

/// Radiance of each pixel, rows from top to bottom.
pub(super) type Picture = Vec<[f64; 3]>;

/// The moments so far; numbers as bits, because a continued side gives the same verdict as one that ran through.
#[derive(Serialize, Deserialize)]
pub(super) struct Side {
    /// What it is of.
    digest: String,
    /// Restarts that are done.
    pub(super) restarts: u32,
    moments: Vec<[u64; 3]>,
}

impl Side {
    /// What is in the file, if there is one and it is not to be made anew.
    pub(super) fn open(path: &Path, digest: String, fresh: bool) -> Result<Self, Error> {
        if fresh || !path.exists() {
            return Ok(Self { digest, restarts: 0, moments: Vec::new() });
        }
        let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
        serde_json::from_str(&text).ok().filter(|side: &Self| side.digest == digest).ok_or_else(|| {
            Error::Environment(format!("{} is of another scene or version; discard it by --fresh", path.display()))
        })
    }

    /// Adds rounds until there are as many restarts; `picture` makes that of a restart.
    pub(super) fn advance(
        mut self,
        path: &Path,
        restarts: u32,
        picture: &(impl Fn(u32) -> Result<Picture, Error> + Sync),
    ) -> Result<Self, Error> {
        while self.restarts < restarts {
            let first = self.restarts;
            let pictures: Vec<Picture> =
                (first..first + ROUND).into_par_iter().map(picture).collect::<Result<_, _>>()?;
            let round = GRID.moments_of(&pictures);
            let before = if first == 0 { vec![Moments::default(); round.len()] } else { self.moments() };
            self.moments = before.iter().zip(round).map(|(a, b)| a.merge(b).parts().map(f64::to_bits)).collect();
            self.restarts += ROUND;
            write_atomically(path, |file| Ok(serde_json::to_writer(file, &self)?))?;
            if self.restarts.is_multiple_of(16 * ROUND) {
                eprintln!("{}: {} restarts", path.display(), self.restarts);
            }
        }
        Ok(self)
    }

    /// Of each channel of each tile, then of the image.
    pub(super) fn moments(&self) -> Vec<Moments> {
        self.moments.iter().map(|bits| Moments::from_parts(bits.map(f64::from_bits))).collect()
    }
}
