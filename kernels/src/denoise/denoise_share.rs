//! What pixels are worth.

use restir_shared::denoise::{self, DenoiseParams, Guide, History, Share};

kernel! {
    /// What a pixel is worth in a round, by how much of its kernel lies on the surface that it sees.
    pub fn denoise_share(8, 8) {
        constants {}
        params 0: DenoiseParams,
        read { 1: guides: Guide, 2: means: History },
        own { 3: shares: Share },
    }
    |x, y, at, p| shares[at] = denoise::share(&p, guides, means, [x, y])
}
