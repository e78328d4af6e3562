//! Path tracing where light scatters inside of things.
//!
//! A path carries what is around it: to pass the front of a closed surface sets it, to pass a back clears it. Between two surfaces it walks:
//! it flies as far as a collision, turns, and flies on. A walk counts as one segment of the path, reflections at the boundary from inside
//! included.
//!
//! Lights are sampled at surfaces on sides where nothing scatters. Through a boundary, which bends light, no point of a light could be aimed
//! at, so that light from outside which is found along a segment inside was found in the only way that there is, and counts in full. Lights
//! within a body that scatters are sampled at collisions, too, and at surfaces that face them, where the material says that there are any.
//! A border that light passes straight is the exception ([`stretch_clear`]): from collisions lights are sampled through it, up to the next surface.
//!
//! A walk may have thousands of segments and a dispatch should not. So it is cut into stretches, and a path that stops after a collision
//! waits as a [`PackedWalker`]. Bits do not depend on where it is cut.
//!
//! A scene without any medium is the simplest case: every path ends within its first stretch, with the bits of [`path`](super). (`Floor` is
//! the scene that the documentation of [`scene`](crate::scene) shows.)
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::glam::Vec3;
//! use restir_shared::layout::CameraParams;
//! use restir_shared::technique::path::media::{MediaParams, PackedWalker, Tally, stretch};
//! use restir_shared::technique::path::{self, PathParams};
//!
//! let camera = CameraParams::pinhole(Vec3::Y, Vec3::ZERO, Vec3::Z, 0.1, [1, 1]);
//! let path = PathParams { max_depth: 3, ..PathParams::new(camera, [1, 1], 7) };
//! let params = MediaParams { path, begins: 1, stretch: 64, longest_walk: 1024, most_order: u32::MAX, ..MediaParams::default() };
//!
//! // paths that wait would be given back with `begins: 0`, until none is left
//! let end = stretch(&Floor, &params, PackedWalker::default(), Tally::default(), [0, 0]);
//! assert_eq!(end.sample, path::pixel(&Floor, &path, 0, 0));
//! assert_eq!((end.tally.walks, end.tally.scatterings), (0, 0));
//! ```

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
#[derive(Debug)]
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
    followed::<S, false>(scene, params, walker, tally, pixel)
}

/// As [`stretch`], where some borders are clear ([`crate::medium::Interior::is_clear`]): through these lights outside are sampled, too.
pub fn stretch_clear<S: Trace + Surface + Lights>(
    scene: &S,
    params: &MediaParams,
    walker: PackedWalker,
    tally: Tally,
    pixel: [u32; 2],
) -> Stretch {
    followed::<S, true>(scene, params, walker, tally, pixel)
}

#[inline(always)]
fn followed<S: Trace + Surface + Lights, const CLEAR: bool>(
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
    let whole = walker.run::<S, CLEAR>(scene, params, &rng);
    let sample = FilmPixel::from_radiance(if whole { walker.radiance } else { CUT });
    Stretch { walker: PackedWalker::pack(&walker), tally: walker.tally, sample }
}
