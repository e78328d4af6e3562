//! Light under surfaces by resampling (ReSTIR SSS; Werner, Schüßler and Dachsbacher 2024, "ReSTIR Subsurface Scattering for Real-Time Path
//! Tracing").
//!
//! A path enters a body ([`hybrid::enter`](super::path::hybrid::enter)). A diffusion profile says what of the light that falls on the body around there
//! comes out at the entry. A *sample* is a point of the body's surface, x2, and a light, x3; its integrand is what it sends to the camera, over the
//! addresses of both. A pixel keeps one ([`PackedSubsurface`], 48 bytes), and pixels share them in [`mutual`] pairs. A body is entered once: everything
//! else is path traced, so that no light is counted twice.
//!
//! **Shifts** take a sample from an entry x1 to another one, y1, of the same body:
//!
//! | shift | y2 | Jacobian | rays |
//! |---|---|---|---|
//! | reconnection | x2 | 1 | none; a shadow ray where the scene has changed |
//! | delayed reconnection | the point that the random numbers of x2's segment find around y1 | p(x2) / p(y2), densities of all axes and channels, times P(y1) / P(x1) of the channel | a probe and a shadow ray |
//! | sequential | reconnection in one pass, delayed reconnection in the next; in between, [`index`] finds random numbers for points, and points for numbers | | a probe a pixel |
//! | hybrid | the former where the profile is smooth ([`is_connectable`]), else the latter | | |
//!
//! Over addresses a light moves with a Jacobian of 1, and so does a point that stays: the published form over solid angles has the factors
//! `cos / distance²` of the light, and mixing both is wrong. A sample keeps what its shift takes ([`Kind`]), and a shift fails where the way back would be of
//! another kind. Where channels are Lambertian the point is the entry itself ([`Kind::AtEntry`]).
//!
//! | pass | reads | makes |
//! |---|---|---|
//! | [`hybrid::enter`](super::path::hybrid::enter) | | entries; direct: what does not enter |
//! | [`initial`] | entries | origins, surfaces; reservoirs: one candidate of each pixel |
//! | [`recall`] | the last frame's reservoirs | these, in place, where the scene has changed since |
//! | [`mutual::reproject`], [`mutual::pair`] | origins, surfaces | requests: whose sample is to be shifted where |
//! | [`mutual::answer`] | requests, origins, reservoirs | results |
//! | [`mutual::merge`] | reservoirs, requests, results | reservoirs: one of a pixel's own and others' |
//! | [`index`] | origins | reservoirs, in place, before and after a pass of the other shift |
//! | [`mutual::shade`] | reservoirs, direct | radiance |
//!
//! [`mutual`]: crate::resample::mutual
//! [`mutual::reproject`]: crate::resample::mutual::reproject
//! [`mutual::pair`]: crate::resample::mutual::pair
//! [`mutual::answer`]: crate::resample::mutual::answer
//! [`mutual::merge`]: crate::resample::mutual::merge
//! [`mutual::shade`]: crate::resample::mutual::shade
//!
//! What the hybrid shift asks of a point:
//!
//! ```
//! use restir_shared::glam::Vec3;
//! use restir_shared::scene::Location;
//! use restir_shared::technique::restir_sss::is_connectable;
//!
//! let at = |x: f32, normal: Vec3| Location { position: Vec3::X * x, normal, offset: 0.0, extent: 1.0 };
//! let entry = at(0.0, Vec3::Z);
//! // on a plane the points stay that are farther than 1; around an edge all do
//! assert!(!is_connectable(&entry, &at(0.5, Vec3::Z), 1.0));
//! assert!(is_connectable(&entry, &at(2.0, Vec3::Z), 1.0));
//! assert!(is_connectable(&entry, &at(0.5, Vec3::X), 1.0));
//! ```
//!
//! Of random numbers stream 0 is that of `path` ([`initial`] has the same points and lights as `path` with diffusion), stream 1 that of [`index`], stream 2 chooses among candidates,
//! streams 3 and 4 are those of [`mutual`].

mod evaluate;
mod index;
mod initial;
mod origin;
mod params;
mod recall;
mod record;
mod shift;

pub use index::index;
pub use initial::{Initial, initial};
pub use origin::{SssOrigin, is_connectable};
pub use params::SssParams;
pub use recall::recall;
pub use record::{Kind, PackedSubsurface, Sample, Stored};

use crate::rng;

/// Where the stream of numbers begins that stand for points: a dimension for each merge.
const NUMBERS: u32 = rng::stream(1);
/// Where the stream of the selections begins: a dimension for each point of each segment.
const SELECTIONS: u32 = rng::stream(2);
