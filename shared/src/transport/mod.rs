//! What techniques that follow light have in common: vertices of paths, connections between them and their weights, what interiors absorb,
//! straight ways through glass, and collisions inside media.
//!
//! A [`Vertex`] is made of the end of a ray at a point of a surface. It is left in a sampled direction ([`Vertex::depart`]), or connected with a
//! point of a light ([`Vertex::connect`]); [`next_event`] and [`emission_weight`] weigh the light that either way finds by the balance
//! heuristic (Veach 1997, §9.2).
//!
//! ```
//! use restir_shared::geometry::Ray;
//! use restir_shared::glam::Vec3;
//! use restir_shared::num::PI;
//! use restir_shared::scene::{LightKind, LightSample, SurfacePoint};
//! use restir_shared::transport::{Vertex, next_event};
//!
//! // the camera sees a point of reflectance 0.5, and two units above it is a lamp of the intensity 8
//! let ray = Ray { origin: Vec3::new(1.0, 1.0, 0.0), direction: Vec3::new(-0.6, -0.8, 0.0), t_max: Ray::FAR, key: 0 };
//! let vertex = Vertex::new(&SurfacePoint::diffuse(Vec3::ZERO, Vec3::Y, 1e-4, Vec3::splat(0.5)), &ray, 0);
//! let (position, emission) = (Vec3::Y * 2.0, Vec3::splat(8.0));
//! let lamp = LightSample { position, emission, density: 1.0, kind: LightKind::Point, ..LightSample::NONE };
//!
//! // reflectance / PI, times intensity / distance²; the shadow ray says whether anything lies between
//! let connection = vertex.connect(&lamp);
//! let radiance = next_event(lamp.density, &connection);
//! assert!((radiance - Vec3::splat(0.5 / PI * 8.0 / 4.0)).length() < 1e-3);
//! assert!(connection.shadow.origin.y > 0.0 && connection.shadow.t_max == 1.0);
//! ```

mod connect;
mod interior;
mod passage;
mod single_scattering;
mod vertex;
mod weight;

pub use connect::Connection;
pub(crate) use connect::shadow_ray;
pub(crate) use single_scattering::{COLLISION_MARGIN, GRAZING_COSINE};
pub use vertex::{Departure, Vertex};
pub use weight::Chosen;

// steps of paths that techniques and kernels share
#[doc(hidden)]
pub use connect::{connect_inside, passes};
#[doc(hidden)]
pub use interior::{absorbs, through_interior};
#[doc(hidden)]
#[cfg(not(target_arch = "spirv"))]
pub(crate) use passage::MAX_STRETCHES;
pub use passage::{Passage, follow, transmittance};
#[doc(hidden)]
pub use single_scattering::{Collision, ScatteredOnce, WayOut, scatter_once};
#[doc(hidden)]
pub use weight::{emission_weight, environment_weight, next_event};
