//! Path tracing with diffusion: light that scattering interiors send back, in three parts (Zhang and d'Eon 2025).
//!
//! Where a path enters a body whose interior scatters, the *boundary term* is what crosses it without a collision, and *single
//! scattering* what collides once: both are traced. The rest is a diffusion profile, less what has collided once
//! ([`Multiple`](crate::diffusion::Multiple)), which is found where a disk's segment meets the body
//! ([`Disk`](crate::diffusion::Disk)). With the whole profile, and nothing else, it is diffusion alone.
//!
//! What a profile holds is what a half space would send back. So light crosses thin bodies by the first two parts, and what the profile
//! adds there is too much; none of it is right to the last digit, and the walk ([`super::media`]) is what it is compared with.
//!
//! A sample takes three kernels' turns. The first traces the path until it enters, leaves an [`PackedEntry`] there, and goes on with the
//! two parts that are traced, from exit to exit; the second finds the points of the profile and the light that enters at them, and leaves
//! a path that goes on from one of them; the first goes on with that. A path enters a body once: later bodies are dark inside.
//!
//! * Between an entry and its exit lies one segment of the path.
//! * Bodies end where their own back is met. What else lies inside is seen by what it emits, and blocks the rest.
//! * A surface reflects outside as it does without an interior, and inside not at all: what it holds back is part of what the profile is a
//!   fit of.
//! * Through a dielectric the profile's light enters and leaves by Fresnel's equations, spread by Lambert's law ([`Exit`]).

mod exit;
mod gather;
mod params;
mod record;
mod shallow;

pub use exit::Exit;
pub use gather::gather;
pub use params::*;
pub use record::PackedEntry;

use crate::film::CUT;
use crate::layout::FilmPixel;
use crate::scene::{Lights, Surface, Trace};
use shallow::Shallow;

/// What a turn leaves behind.
pub struct Turn {
    /// What the next one goes on from.
    pub entry: PackedEntry,
    /// The sample so far.
    pub sample: FilmPixel,
}

/// Traces the path of the pixel (x, y), or goes on with the one that `entry` has, as far as it goes without a profile.
pub fn trace<S: Trace + Surface + Lights>(
    scene: &S,
    params: &HybridParams,
    entry: PackedEntry,
    pixel: [u32; 2],
) -> Turn {
    let rng = params.rng(pixel);
    let mut path = if params.resumes != 0 {
        Shallow::resume(entry.resumed())
    } else {
        Shallow::new(params, &rng, scene.features(), pixel)
    };
    let whole = path.run(scene, params, &rng);
    let radiance = if whole { path.radiance() } else { CUT };
    Turn { entry: path.record(radiance), sample: FilmPixel::from_radiance(radiance) }
}
