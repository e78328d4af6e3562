//! Means over frames.

use restir_shared::denoise::{self, DenoiseParams, Guide, History, Track};
use restir_shared::layout::FilmPixel;

kernel! {
    /// Adds a pixel of the picture to what the last frame knew of its surface.
    pub fn denoise_accumulate(8, 8) {
        constants {}
        params 0: DenoiseParams,
        read {
            1: picture: FilmPixel,
            2: guides: Guide,
            3: tracks: Track,
            4: other_guides: Guide,
            5: other_means: History,
        },
        own { 6: means: History },
    }
    |x, y, at, p| {
        let index = (y * p.width + x) as usize;
        means[at] =
            denoise::accumulate(&p, picture[index], &guides[index], &tracks[index], other_guides, other_means)
    }
}
