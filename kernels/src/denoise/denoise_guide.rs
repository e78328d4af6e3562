//! What pixels see.

use restir_shared::denoise::{self, Guide, GuideParams, Track};

kernel! {
    /// What a pixel sees, by which neighbours are told apart, and where the last frame saw the same.
    pub fn denoise_guide(8, 8) {
        constants { 0: features = 0xffff_ffff }
        params 0: GuideParams,
        asks probed_frames(features) { 1: geometry, 2: attributes, 3: texels },
        read {},
        own { 4: guides: Guide, 5: tracks: Track },
    }
    |x, y, at, p, frames| (guides[at], tracks[at]) = denoise::guide(&frames, &p, [x, y])
}
