//! How much of its surface a pixel has around it.

use restir_shared::denoise::{self, DenoiseParams, Guide};

kernel! {
    /// Which part of a round's kernel lies on the surface that the pixel sees.
    pub fn denoise_share(8, 8) {
        constants {}
        params 0: DenoiseParams,
        read { 1: guides: Guide },
        own { 2: shares: f32 },
    }
    |x, y, at, p| shares[at] = denoise::share(&p, guides, [x, y])
}
