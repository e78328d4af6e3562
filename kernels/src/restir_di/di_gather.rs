//! Shading with neighbours, last part.

use restir_shared::layout::FilmPixel;
use restir_shared::technique::restir_di::{self, DiPairs, DiParams, DiPoint};

kernel! {
    /// The radiance of each pixel by way of several reservoirs, as a film's sample: `film` begins with the neighbours' part.
    pub fn di_gather(8, 8) {
        constants {}
        params 0: DiParams,
        read { 1: points: DiPoint, 2: pairs: DiPairs, 3: direct: FilmPixel },
        own { 4: film: FilmPixel },
    }
    |x, y, at, p| film[at] = restir_di::gather(&p, points, pairs, direct[(y * p.width + x) as usize], film[at], [x, y])
}
