//! Integration prefixes.

use restir_shared::layout::FilmPixel;
use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_suffix::{self, SuffixParams, Throughput};

kernel! {
    /// Traces an integration prefix from each pixel, and adds the light that it finds to the picture, which begins with the first one.
    pub fn suffix_prefix(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: SuffixParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        read {},
        own { 4: ends: PathOrigin, 5: throughputs: Throughput, 6: film: FilmPixel },
    }
    |x, y, at, p, scene| {
        let p = p.specialised(settings);
        let prefix = restir_suffix::prefix(&scene, &p, &p.integration([x, y]), true, [x, y]);
        ends[at] = prefix.end;
        throughputs[at] = Throughput::new(prefix.throughput);
        film[at] = restir_suffix::begin(&p, film[at], prefix.light)
    }
}
