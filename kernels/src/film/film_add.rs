//! Merges two film planes that hold neighbouring blocks of samples.

use restir_shared::layout::{FilmParams, FilmPixel};

kernel! {
    /// `sum = left + right`, pixel by pixel.
    pub fn film_add(8, 8) {
        constants {}
        params 0: FilmParams,
        read { 1: left: FilmPixel },
        own { 2: right: FilmPixel },
    }
    |x, y, at, p| right[at] = left[(y * p.width + x) as usize].merge(right[at])
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    [[16, 16], [13, 7], [1, 1]]
        .map(|[width, height]| {
            let params = FilmParams { width, height, samples: 2.0, reserved: 0 };
            let plane = |salt: u32| crate::case::film_plane(width * height, salt);
            crate::Case::new(&DESC, format!("{width}x{height}"), width, height)
                .with(&[params])
                .with(&plane(1))
                .with(&plane(2))
        })
        .into()
}
