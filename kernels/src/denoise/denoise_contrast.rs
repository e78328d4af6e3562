//! How pixels differ from the next ones.

use restir_shared::denoise::{self, Contrast, DenoiseParams, Guide, History};

kernel! {
    /// Squared differences of luminance in four directions, of the means of frames.
    pub fn denoise_contrast(8, 8) {
        constants {}
        params 0: DenoiseParams,
        read { 1: guides: Guide, 2: means: History },
        own { 3: contrasts: Contrast },
    }
    |x, y, at, p| contrasts[at] = denoise::contrast(&p, guides, means, [x, y])
}
