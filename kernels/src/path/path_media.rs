//! Path tracing through media, one stretch of one sample of every pixel.

#[cfg(not(target_arch = "spirv"))]
use restir_shared::layout::FEATURES_MEDIA;
use restir_shared::layout::FilmPixel;
use restir_shared::technique::path::media::{self, MediaParams, PackedWalker, Tally};

kernel! {
    /// Goes on with the path of each pixel until it ends, and leaves its sample in the film, or until it waits in its walker.
    pub fn path_media(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: MediaParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels } compiled [FEATURES_MEDIA],
        read {},
        own { 4: walkers: PackedWalker, 5: tallies: Tally, 6: film: FilmPixel },
    }
    |x, y, at, p, scene| {
        if (p.begins != 0) | walkers[at].goes_on() {
            let stretch = media::stretch(&scene, &p.specialised(settings), walkers[at], tallies[at], p.path.in_image([x, y]));
            walkers[at] = stretch.walker;
            tallies[at] = stretch.tally;
            if !stretch.walker.goes_on() {
                film[at] = stretch.sample;
            }
        }
    }
}
