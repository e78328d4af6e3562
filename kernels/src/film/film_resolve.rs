//! Divides the film by the number of samples.

use restir_shared::layout::{FilmParams, FilmPixel};

kernel! {
    /// `mean = sum / samples`, pixel by pixel; the count of dropped samples is kept.
    pub fn film_resolve(8, 8) {
        constants {}
        params 0: FilmParams,
        read { 1: sum: FilmPixel },
        own { 2: mean: FilmPixel },
    }
    |x, y, at, p| {
        mean[at] = sum[(y * p.width + x) as usize].mean(p.samples);
    }
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    [1.0, 7.0, 64.0, 1000.0, 134_217_728.0]
        .map(|samples| {
            let params = FilmParams { width: 13, height: 7, samples, reserved: 0 };
            crate::Case::new(&DESC, format!("{samples} spp"), 13, 7)
                .with(&[params])
                .with(&crate::case::film_plane(13 * 7, 3))
                .output()
        })
        .into()
}
