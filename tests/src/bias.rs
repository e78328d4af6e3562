//! Tests for bias: moments of images over restarts, and what their comparison has to say.

use crate::stats::{Moments, TileGrid, Verdict};
use crate::suite::ensure;
use libtest_mimic::Failed;
use rayon::prelude::*;
use restir_host::Error;
use restir_shared::layout::FilmPixel;
use restir_shared::scene::{Lights, Surface, Trace};
use restir_shared::technique::path::{self, PathParams};

/// Moments of path tracing: a restart has the parameters' seed plus its number.
pub fn path_moments(
    grid: TileGrid,
    restarts: u32,
    scene: &(impl Trace + Surface + Lights + Sync),
    params: PathParams,
) -> Vec<Moments> {
    grid.moments(restarts, |restart, x, y| {
        path::pixel(scene, &PathParams { seed: params.seed + restart, ..params }, x, y).sum.map(f64::from)
    })
}

/// Moments of films, each made of a seed.
///
/// # Errors
/// As of `film`, and if a sample was dropped.
pub fn film_moments(
    grid: TileGrid,
    restarts: u32,
    film: impl Fn(u32) -> Result<Vec<FilmPixel>, Error> + Sync,
) -> Result<Vec<Moments>, Failed> {
    let films: Vec<Vec<FilmPixel>> = (0..restarts).into_par_iter().map(&film).collect::<Result<_, _>>()?;
    ensure(films.iter().flatten().all(|pixel| pixel.dropped == 0.0), || "samples were dropped".to_owned())?;
    Ok(grid
        .moments(restarts, |restart, x, y| films[restart as usize][(y * grid.width + x) as usize].sum.map(f64::from)))
}

/// Nothing differs, and a bias of the image's mean of the given size would have been noticed; `what` is for messages.
///
/// # Errors
/// The verdict, if this is not so.
pub fn ensure_unbiased(what: &str, verdict: &Verdict, noticed: f64) -> Result<(), Failed> {
    println!("{what}: {verdict}");
    ensure(verdict.passed(), || format!("{what}: {verdict}"))?;
    ensure(verdict.detectable_in_image <= noticed, || format!("{what}: too few samples: {verdict}"))
}

/// Something differs: the comparison can fail.
///
/// # Errors
/// The verdict, if nothing does.
pub fn ensure_biased(what: &str, verdict: &Verdict) -> Result<(), Failed> {
    println!("{what}: {verdict}");
    ensure(!verdict.passed(), || format!("{what}: no bias is seen: {verdict}"))
}
