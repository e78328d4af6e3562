//! How noisy pixels are.

use restir_shared::denoise::{self, Contrast, DenoiseParams, Estimate, Guide, History};

kernel! {
    /// The mean of a pixel's frames, and its variance.
    pub fn denoise_estimate(8, 8) {
        constants {}
        params 0: DenoiseParams,
        read { 1: guides: Guide, 2: means: History, 3: contrasts: Contrast },
        own { 4: estimates: Estimate },
    }
    |x, y, at, p| estimates[at] = denoise::estimate(&p, guides, means, contrasts, [x, y])
}
