//! Path tracing where light scatters inside of things.
//!
//! A path carries what is around it: to pass the front of a closed surface
//! sets it, to pass a back clears it. Between two surfaces it walks: it flies as far as a collision, turns, and flies on. A walk counts as one
//! segment of the path, reflections at the boundary from inside included.
//!
//! Lights are sampled at surfaces, and only on sides where nothing scatters: through a boundary, which bends light, no point of a light
//! could be aimed at. So light that is found along a segment through a scattering interior was found in the only way that there is, and counts
//! in full.
//!
//! A walk may have thousands of segments and a dispatch should not. So it is cut into stretches, and a path that stops after a collision
//! waits as a [`PackedWalker`]. Bits do not depend on where it is cut.

mod params;
mod trace;
mod walker;

pub use params::{MAX_WALK, MediaParams};
pub use walker::{PackedWalker, Tally};

use crate::film::CUT;
use crate::layout::FilmPixel;
use crate::scene::{Lights, Surface, Trace};
use walker::Walker;

/// What a stretch leaves behind.
pub struct Stretch {
    /// The path, if it goes on.
    pub walker: PackedWalker,
    /// What was counted so far.
    pub tally: Tally,
    /// The sample; of a path that goes on only what it has found so far.
    pub sample: FilmPixel,
}

/// Goes on with the path of the pixel (x, y), or begins it, until it ends or was followed far enough.
pub fn stretch<S: Trace + Surface + Lights>(
    scene: &S,
    params: &MediaParams,
    walker: PackedWalker,
    tally: Tally,
    pixel: [u32; 2],
) -> Stretch {
    let rng = params.rng(pixel);
    let tally = if params.counts_anew != 0 { Tally::default() } else { tally };
    let mut walker = if params.begins != 0 {
        Walker::new(params, &rng, scene.features(), pixel, tally)
    } else {
        walker.unpack(tally)
    };
    let whole = walker.run(scene, params, &rng);
    let sample = FilmPixel::from_radiance(if whole { walker.radiance } else { CUT });
    Stretch { walker: PackedWalker::pack(&walker), tally: walker.tally, sample }
}
