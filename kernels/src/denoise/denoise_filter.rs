//! A round of the filter.

use restir_shared::denoise::{self, DenoiseParams, Estimate, Guide, Share};

kernel! {
    /// The mean of a pixel and its neighbours, as far as noise explains their difference.
    pub fn denoise_filter(8, 8) {
        constants {}
        params 0: DenoiseParams,
        read { 1: guides: Guide, 2: estimates: Estimate, 3: shares: Share },
        own { 4: filtered: Estimate },
    }
    |x, y, at, p| filtered[at] = denoise::filter(&p, guides, estimates, shares, [x, y])
}
