//! The picture.

use restir_shared::denoise::{self, DenoiseParams, Estimate, Guide, Track};
use restir_shared::layout::FilmPixel;

kernel! {
    /// Light, of what was filtered and what the surface gives back.
    pub fn denoise_modulate(8, 8) {
        constants {}
        params 0: DenoiseParams,
        read { 1: picture: FilmPixel, 2: guides: Guide, 3: tracks: Track, 4: filtered: Estimate },
        own { 5: denoised: FilmPixel },
    }
    |x, y, at, p| {
        let index = (y * p.width + x) as usize;
        denoised[at] = denoise::modulate(picture[index], &guides[index], &tracks[index], &filtered[index])
    }
}
