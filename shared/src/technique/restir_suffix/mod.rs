//! Suffixes of paths by resampling, and a final gather (Kettunen et al. 2023, "Conditional Resampled Importance Sampling and ReSTIR").
//!
//! A path is cut in two: a **prefix** from the camera to some vertex ([`EndRule`] says which), and a **suffix** from there to a light. Each pixel
//! has a *supporting* prefix, and a reservoir of suffixes that begin at its end, which is what frames and pixels share: a path of ReSTIR PT
//! ([`PackedPath`](super::restir_pt::PackedPath)) whose [`PathOrigin`](crate::shift::PathOrigin) is that end. The picture is made of
//! *integration* prefixes, new in every frame, that borrow the suffixes of supporting prefixes nearby. The passes:
//!
//! | pass | reads | makes |
//! |---|---|---|
//! | [`prefix`], supporting | | origins: where the prefix ends; what the pixel sees |
//! | [`mutual::reproject`], [`keep`] | the last frame's surfaces and origins | origins: the last frame's, if that is kept; requests for the suffixes that begin there |
//! | [`suffix`] | origins | a suffix |
//! | [`mutual::merge`] | requests, the last frame's suffixes | one of both; where the scene has changed after [`recall`](super::restir_pt::recall) and shifts |
//! | [`PrefixPoint`], [`compact`](crate::compact) | origins | a grid of the ends of prefixes: [`PrefixGrid`] |
//! | [`PrefixGrid::pair`], [`mutual::answer`], [`mutual::merge`] | the grid, suffixes | one of a pixel's suffix and its partner's |
//! | for each integration prefix: [`prefix`] | | its end, its throughput, and the light that it finds on its way |
//! | [`PrefixGrid::nearest`] | the grid, the end | whose suffixes it borrows |
//! | [`ask`], [`mutual::answer`] | these, suffixes | what the suffixes are at its end, and at each other's |
//! | [`Lent::borrowed`] | results | what they send to the pixel |
//! | for some of them: [`suffix`], [`ask`], [`mutual::answer`], [`Lent::canonical`] | | what a suffix of its own sends |
//!
//! What is conditioned by prefixes must not decide about them. Which prefixes are kept, found and paired is said by prefixes alone; seeds tell the
//! random numbers of supporting prefixes, integration prefixes, suffixes and canonical suffixes apart ([`SuffixParams::supporting`] and the next
//! ones). [`conditional`](crate::conditional) has this in types.
//!
//! [`mutual::reproject`]: crate::resample::mutual::reproject
//! [`mutual::merge`]: crate::resample::mutual::merge
//! [`mutual::answer`]: crate::resample::mutual::answer
//!
//! A prefix and a suffix of one pixel. (`Floor` is the scene that the documentation of [`scene`](crate::scene) shows.)
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::glam::Vec3;
//! use restir_shared::layout::CameraParams;
//! use restir_shared::resample::mutual::Record;
//! use restir_shared::technique::restir_suffix::{EndRule, SuffixParams, prefix, suffix};
//!
//! let camera = CameraParams::pinhole(Vec3::Y, Vec3::ZERO, Vec3::Z, 0.01, [1, 1]);
//! // prefixes end at what the camera sees: there is nothing else
//! let ends = EndRule { min_segments: 1, ..EndRule::default() };
//! let params = SuffixParams { ends, ..SuffixParams::new(camera, [1, 1], 7) };
//!
//! let prefix = prefix(&Floor, &params, &params.integration([0, 0]), true, [0, 0]);
//! let suffix = suffix(&Floor, &params.canonical(), &prefix.end, [0, 0]);
//! // the lamp, by way of the floor below it
//! let radiance = prefix.throughput * suffix.value() * suffix.contribution_weight();
//! assert!((radiance.x - 1.0).abs() < 2e-3);
//! ```

mod gather;
mod grid;
mod keep;
mod params;
mod prefix;
mod suffix;

#[doc(hidden)]
pub use gather::begin;
pub use gather::{Asks, Lent, Throughput, ask};
pub use grid::{MAX_BORROWED, Nearest, PrefixGrid, PrefixPoint};
pub use keep::{Kept, keep};
pub use params::SuffixParams;
pub use prefix::{EndRule, Prefix, prefix};
pub use suffix::suffix;
