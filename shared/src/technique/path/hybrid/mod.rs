//! Path tracing with diffusion: light that scattering interiors send back, in three parts (Zhang and d'Eon 2025).
//!
//! Where a path enters a body whose interior scatters, the *boundary term* is what crosses it without a collision, and *single
//! scattering* what collides once: both are traced. The rest is a diffusion profile, less what has collided once
//! ([`Multiple`](crate::diffusion::Multiple)), which is found where a disk's segment meets the body
//! ([`Disk`](crate::diffusion::Disk)). With the whole profile, and nothing else, it is diffusion alone.
//!
//! A profile holds what a half space would send back, which is too much where a body is thin. The ray of the boundary term measures how thick the body
//! is there, and the profile is taken to that ([`Thickness`](crate::diffusion::Thickness)). That is a fit, and the walk ([`super::media`]) is what
//! it is compared with.
//!
//! A sample takes three turns. The first (`path_entry`) traces the path until it enters a body and on across it, and leaves a [`PackedEntry`]. The second
//! (`path_profile`) finds the points of the profile and the light that enters at them, and leaves a path that goes on from one of them, a
//! [`PackedExit`]. The third (`path_exits`) goes on with that path, then from the far side of the body and through one collision. A
//! path enters a body once: later bodies are Lambertian, in the colour of their medium.
//!
//! * Between an entry and its exit lies one segment of the path.
//! * Bodies end where their own back is met. What else lies inside is seen by what it emits, and blocks the rest.
//! * A surface reflects outside as it does without an interior, and inside not at all: what it holds back is part of what the profile is a
//!   fit of.
//! * Through a dielectric the profile's light enters and leaves by Fresnel's equations, spread by Lambert's law ([`Exit`]).
//!
//! A scene without any medium is the simplest case: nothing enters, and the first turn finds the sample of [`path`](super). (`Floor` is the
//! scene that the documentation of [`scene`](crate::scene) shows.)
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::glam::Vec3;
//! use restir_shared::layout::CameraParams;
//! use restir_shared::technique::path::hybrid::{HybridParams, enter};
//! use restir_shared::technique::path::{self, PathFlags, PathParams};
//!
//! let camera = CameraParams::pinhole(Vec3::Y, Vec3::ZERO, Vec3::Z, 0.1, [1, 1]);
//! let path = PathParams { max_depth: 3, ..PathParams::new(camera, [1, 1], 7) };
//! let counted = PathParams { flags: path.flags | PathFlags::REST, ..path };
//! let entered = enter(&Floor, &HybridParams { path: counted, ..HybridParams::default() }, [0, 0]);
//! assert_eq!(entered.sample, path::pixel(&Floor, &path, 0, 0));
//! ```

mod branches;
mod exit;
mod gather;
mod params;
mod points;
mod profile;
mod record;
mod segment;

pub use exit::Exit;
pub use gather::gather;
pub use params::*;
pub(crate) use points::{ENTRY, Found, Points, segment_key};
pub(crate) use profile::EntryProfile;
pub(crate) use record::Entry;
pub use record::{PackedEntry, PackedExit};
pub(crate) use segment::Segment;

use crate::film::CUT;
use crate::layout::FilmPixel;
use crate::scene::{Lights, Surface, Trace};
use branches::Branches;

/// What a path leaves that may enter a body.
#[derive(Debug)]
pub struct Entered {
    /// Where the path enters a body, and with what throughput; nowhere, if it does not.
    pub entry: PackedEntry,
    /// Radiance that the path has found outside, as a film's sample.
    pub sample: FilmPixel,
}

/// Traces the path of a sample of the pixel (x, y) as far as it goes outside.
pub fn enter<S: Trace + Surface + Lights>(scene: &S, params: &HybridParams, pixel: [u32; 2]) -> Entered {
    let rng = params.rng(pixel);
    let mut path = Branches::<true>::new(params, &rng, scene.features(), pixel);
    let whole = path.run(scene, params, &rng);
    let radiance = if whole { path.radiance() } else { CUT };
    Entered { entry: PackedEntry::new(path.entry(), radiance), sample: FilmPixel::from_radiance(radiance) }
}

/// Goes on with what a path has left in both planes: the sample.
pub fn leave<S: Trace + Surface + Lights>(
    scene: &S,
    params: &HybridParams,
    entry: PackedEntry,
    exit: PackedExit,
    pixel: [u32; 2],
) -> FilmPixel {
    let rng = params.rng(pixel);
    let mut path = Branches::<false>::from_body(scene, entry.entry(), exit);
    let whole = path.run(scene, params, &rng);
    FilmPixel::from_radiance(if whole { path.radiance() } else { CUT })
}
