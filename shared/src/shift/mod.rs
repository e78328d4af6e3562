//! Shifts of paths: how a path of one domain becomes a path of another one, and what that does to areas (Lin et al. 2022, "Generalized
//! Resampled Importance Sampling", §4 and §7).
//!
//! A domain is a [`Start`]: vertex 1, a hit seen from a direction. A [`Path`] goes on from there, over vertices 2, 3, ... to a light,
//! its vertex `length`. It is known by its random numbers, by the index k of its **reconnection vertex** and by what lies there and
//! beyond. [`shift`] takes it to another start y: vertices 2 to k - 1 are made anew by the same random numbers (**random replay**),
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
//! **A shift is undone by the same function** with the roles of the starts exchanged, and it fails where that would fail or give another
//! path: k is the first vertex at which [`Hybrid`] lets the path be joined, of the path at x as of the path at y.

mod hybrid;
mod join;
mod path;
mod start;

pub use hybrid::{Cause, Numbers, Shifted, shift};
pub use join::{End, Hybrid, Joins};
pub use path::Path;
pub use start::Start;
