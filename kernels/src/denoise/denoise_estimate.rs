//! How noisy pixels are.

use restir_shared::denoise::{self, DenoiseParams, Estimate, Guide, History};

kernel! {
    /// The mean of a pixel's frames, and its variance.
    pub fn denoise_estimate(8, 8) {
        constants {}
        params 0: DenoiseParams,
        read { 1: guides: Guide, 2: means: History },
        own { 3: estimates: Estimate },
    }
    |x, y, at, p| estimates[at] = denoise::estimate(&p, guides, means, [x, y])
}
