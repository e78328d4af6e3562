//! Shifts of paths: how a path of one domain becomes a path of another one, and what that does to areas (Lin et al. 2022, "Generalized
//! Resampled Importance Sampling", §4 and §7).
//!
//! A domain is a [`PathOrigin`]: vertex 1, a hit seen from a direction. A [`Path`] goes on from there, over vertices 2, 3, ... to a light,
//! its vertex `length`. It is known by its random numbers, by the index k of its **reconnection vertex** and by what lies there and
//! beyond. [`shift`] takes it to another origin y: vertices 2 to k - 1 are made anew by the same random numbers (**random replay**),
//! then the path is joined to vertex k and keeps all that follows (**reconnection**). So there is one shift, the **hybrid** one, and
//! [`Hybrid`] says where it may join; with [`Hybrid::RECONNECTION`] it never replays, with [`Hybrid::REPLAY`] it joins nothing but
//! sampled lights.
//!
//! **The measure is that of random numbers** (primary sample space). A direction and the lobe that gave it stand for an area of
//! random numbers of its density p, so the integrand is `f / P`, P being the density over all lobes, which is what path tracing adds up.
//! What is replayed has a Jacobian of 1. What is kept has the ratio of its densities given what comes before: a path's [`Path::term`]
//! is the part of its density in which its predecessors enter, and the **Jacobian is the term at y over the term at x**. With
//! vertex k at z, its predecessor y, its successor w, `p(.|l)` the density of one lobe with the probability of its selection, and
//! `G(a, b) = |cos_b| / |a - b|²`:
//!
//! | | what lies at k | integrand at y, after the throughput T | term |
//! |---|---|---|---|
//! | A | a surface; w is drawn by scattering | `f/P(y, z) f/P(z, w) L` | `p(y→z given l) G(y, z) p(z→w given l')` |
//! | A' | the same, w is the light | `f/P(y, z) f L / (P + q)` | the same, times `G(z, w)` extent(w) |
//! | B | a surface; w is a sampled light | `f/P(y, z) f L / (P + q)` | `p(y→z given l) G(y, z)` q extent(w) |
//! | C | a light that scattering finds | `f L / (P + q)` | `p(y→z given l) G(y, z)` extent(z) |
//! | D | a sampled light | `f L / (P + q)` | q extent(z) |
//! | E, F | as C and D, the environment | | without G |
//! | G | nothing: the light is found by replay | `L` weighted | 1 |
//! | H | a sampled point or directional light | `f L / q` | q |
//!
//! f contains the cosine at the vertex that scatters, q is the density of light sampling per solid angle, and the weights of the balance
//! heuristic between the two techniques are folded in: they are evaluated at y. Where the light is at k or next to it, the path
//! keeps its address, and radiance and densities are asked for anew. The extent is that of the light's parametrisation
//! ([`AddressedLight`](crate::scene::AddressedLight)): a path that moves with its light keeps its coordinates.
//!
//! **A shift is undone by the same function** with the roles of the origins exchanged, and it fails where that would fail or give another
//! path: k is the first vertex at which [`Hybrid`] lets the path be joined, of the path at x as of the path at y.
//!
//! A path that ends at a sampled light is taken from one point of a floor to another one. (`Floor` is the scene that the documentation of
//! [`scene`](crate::scene) shows.)
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::geometry::Ray;
//! use restir_shared::glam::{UVec4, Vec3};
//! use restir_shared::rng::{Rng, Sampler};
//! use restir_shared::scene::{AddressedLights, Trace};
//! use restir_shared::shift::{Cause, Hybrid, Numbers, Path, PathOrigin, shift};
//!
//! struct Drawn(Rng);
//! impl Numbers for Drawn {
//!     fn scatter(&self, vertex: u32) -> UVec4 { self.0.draw(vertex) }
//!     fn joins(&self) -> UVec4 { self.0.draw(0) }
//! }
//!
//! let numbers = Drawn(Rng::new(0, 0, 0, 7, Sampler::Sobol));
//! let light = Floor.choose_address(numbers.0.draw(9));
//! // vertex 1 is the origin, vertex 2 the lamp: row H of the table, whose term is the probability of the light
//! let path = Path { length: 2, reconnection: 2, light_sampled: true, light, term: 1.0, ..Path::NONE };
//! let taken = |path: &Path, x: f32| {
//!     let ray = Ray { origin: Vec3::new(x, 1.0, 0.0), direction: Vec3::NEG_Y, t_max: Ray::FAR, key: 0 };
//!     // nothing has changed since it was found
//!     shift(&Floor, &numbers, &Hybrid::RECONNECTION, &PathOrigin::new(&ray, &Floor.closest(&ray)), path, false)
//! };
//! let at = |x: f32| taken(&path, x);
//!
//! // both have a Jacobian of 1; two units aside, light comes at 45 degrees from twice the squared distance: 2^-0.5 / 2
//! assert_eq!((at(0.0).term, at(2.0).term), (1.0, 1.0));
//! assert!((at(0.0).value.x - 1.0).abs() < 1e-3);
//! assert!((at(2.0).value.x - 0.5_f32.sqrt() / 2.0).abs() < 1e-3);
//! // where a shift gives no path, it says why
//! let none = taken(&Path::NONE, 0.0);
//! assert_eq!((none.cause, none.term), (Cause::Unshiftable, 0.0));
//! ```

mod hybrid;
mod join;
mod origin;
mod path;

pub use crate::resample::mutual::{Cause, Shifted};
pub use hybrid::{Numbers, shift};
pub use join::{End, Hybrid, Joins};
pub use origin::PathOrigin;
pub use path::{KeptPath, Path};
