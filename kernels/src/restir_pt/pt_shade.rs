//! The picture.

use restir_shared::layout::FilmPixel;
use restir_shared::technique::restir_pt::{self, PackedPath, PtParams};

kernel! {
    /// The radiance of each pixel by way of its path.
    pub fn pt_shade(8, 8) {
        constants {}
        params 0: PtParams,
        read { 1: reservoirs: PackedPath, 2: direct: FilmPixel },
        own { 3: film: FilmPixel },
    }
    |x, y, at, p| {
        let index = (y * p.width + x) as usize;
        film[at] = restir_pt::shade(&reservoirs[index], direct[index])
    }
}
