//! Scattering functions in the frame of the surface: +z is the shading normal on the side of the viewer, and all
//! directions point away from the surface.
//!
//! A [`Material`] is glTF's metallic-roughness model with its transmission extensions. For one direction to the
//! viewer it becomes a [`Bsdf`]: a weighted mixture of four lobes. With metalness m, T = (1 - m) transmission and
//! P = (1 - m)(1 - transmission) they are
//!
//! | lobe | value |
//! |---|---|
//! | [`DIFFUSE_REFLECTION`] | `P (1 - d) base / pi C(cos_o) C(cos_i) / mean C`, d the diffuse transmission |
//! | [`DIFFUSE_TRANSMISSION`] | `P d color / pi C(cos_o) C(cos_i) / mean C` |
//! | [`SPECULAR_REFLECTION`] | `D G2 (f0 + (f90 - f0)(1 - o.h)^5 + m I + T F) / (4 cos_o cos_i)` |
//! | [`SPECULAR_TRANSMISSION`] | `T base (1 - F) D G2 abs(o.h i.h) no^2 / (cos_o cos_i (ni i.h + no o.h)^2)` |
//!
//! Here o is the direction to the viewer, i that to the light, h the half vector of the two (Walter et al. 2007, eq. 13 and 16), `cos_o` and
//! `cos_i` are their cosines to the normal, and `no` and `ni` the indices of refraction on their sides. `base` is the base colour,
//! `color` that of diffuse transmission. D and G2 are GGX with Smith's height-correlated masking (Walter et al. 2007, eq. 33; Heitz 2014, eq. 99; Walter's
//! eq. 21 for the transmission), F is Fresnel's reflectance of a dielectric, `Fs` Schlick's approximation between
//! f0s and f90s, `f0 = m base + P f0s` and `f90 = m + P f90s`. With s and k the factor and the colour of
//! `KHR_materials_specular` (1 without it), `f0s = s min(k ((ior - 1) / (ior + 1))^2, 1)` and f90s = s; with `ior = 1` P has no
//! specular part (`Fs = 0`, `f90 = m`), and what is left is Lambert's law.
//!
//! * **Energy is kept** ([`crate::layout::FEATURE_MULTISCATTER`]). The diffuse lobes have what the coat does not reflect:
//!   C(cos) is one less the albedo of the coat towards the cosine, and its mean is over the hemisphere (Kelemen and Szirmay-Kalos
//!   2001; Kulla and Conty 2017). Metal returns in its own lobe what single scattering loses: white metal is scaled by
//!   `g(cos_o) g(cos_i)`, which gives it an albedo of 1 at every angle and is reciprocal; coloured metal has
//!   `I = K (g(cos_o) g(cos_i) - 1) (base + (1 - base)(1 - o.h)^5)`, where `K = a E / (1 - a (1 - E))` is the colour of more
//!   than one reflection, a the mean of Schlick's reflectance, `base + (1 - base) / 21`, and E the mean albedo of single
//!   scattering (Fdez-Aguera 2019). C, E and g are fits ([`albedo`]). So sampling and densities are those of single
//!   scattering: visible normals, where nothing is transmitted only those that reflect to above the horizon, or nearly (Eto and
//!   Tokuyoshi 2023). A white surface returns 0.99 to 1.0005 of the light that reaches it, at every roughness, metalness
//!   and index up to 3 (docs/furnace.md), and at most 1.001 at index 5.
//! * Without that feature, C is `1 - Fs(cos)`, its mean counts as 1 (Ashikhmin and Shirley 2000), and I is 0: scattering is
//!   single. A white metal, seen from above, then keeps 0.99 of the energy at roughness 0.3, 0.92 at 0.5, 0.70 at 0.7, and
//!   1 - ln 2 = 0.31 at 1, and white plastic less than 0.1 at grazing angles. glTF's own weight `1 - Fs(v.h)` of the diffuse
//!   lobe gains energy at grazing angles, up to a factor of nearly 2.
//! * Rough transmission scatters once in either case: docs/furnace.md has what it loses.
//! * The transmission scales **radiance** by (no / ni)^2, as paths from the camera need; there is no such factor where
//!   a material is `thin`: then light goes straight through, spread by D as if mirrored at the surface.
//! * Below roughness [`DELTA_BELOW`] the specular lobes are perfect (deltas); so is a transmission lobe that
//!   refraction makes narrower than 2e-5, as where the indices of both sides are almost equal.
//! * A cosine below [`COS_MIN`] counts as zero in value, density and sampling alike.
//!
//! ```
//! use restir_shared::bsdf::{Material, Scattering, ScatteringFunction};
//! use restir_shared::glam::Vec3;
//! use restir_shared::layout::FEATURES_ALL;
//! use restir_shared::rng::{Rng, Sampler};
//!
//! // rough white metal, seen at 45 degrees
//! let metal = Material { metallic: 1.0, roughness: 0.6, ..Material::diffuse(Vec3::ONE) };
//! let bsdf = metal.bsdf(Vec3::new(0.5_f32.sqrt(), 0.0, 0.5_f32.sqrt()), true, FEATURES_ALL);
//!
//! // sampled directions have the value and the density that `evaluate` gives, and their mean weight is the albedo: all light comes back
//! let mut albedo = 0.0;
//! for i in 0..4096 {
//!     let sample = bsdf.sample(Rng::new(0, 0, i, 7, Sampler::Sobol).draw(0));
//!     albedo += sample.weight.x / 4096.0;
//!     let evaluation = bsdf.evaluate(sample.direction);
//!     assert!((evaluation.pdf - sample.pdf).abs() <= 1e-3 * sample.pdf);
//! }
//! assert!((0.98..1.01).contains(&albedo), "{albedo}");
//! ```

#[doc(hidden)]
pub mod albedo;
mod coat;
mod compensation;
mod fresnel;
mod ggx;
mod gloss;
#[doc(hidden)]
pub mod markers;
mod material;
mod mixture;
mod scattering;

// parts of a scattering function, for kernels of checks and for diffusion
#[doc(hidden)]
pub use fresnel::{Dielectric, Fresnel, schlick_complement, schlick_weight};
#[doc(hidden)]
pub use ggx::{Facet, Ggx};
#[doc(hidden)]
pub use gloss::Gloss;
pub use material::Material;
pub use mixture::{Bsdf, BsdfSample, Evaluation, Kind, is_specular, is_transmission};
pub use scattering::{Scattering, ScatteringFunction};

/// Lobe: diffuse reflection.
pub const DIFFUSE_REFLECTION: u32 = 0;
/// Lobe: diffuse transmission.
pub const DIFFUSE_TRANSMISSION: u32 = 1;
/// Lobe: specular reflection, rough or perfect.
pub const SPECULAR_REFLECTION: u32 = 2;
/// Lobe: specular transmission, rough or perfect.
pub const SPECULAR_TRANSMISSION: u32 = 3;
/// Number of lobes.
#[doc(hidden)]
pub const LOBES: u32 = 4;

/// The perceptual roughness below which specular lobes are perfect. GGX's alpha is its square.
#[doc(hidden)]
pub const DELTA_BELOW: f32 = 0.01;
/// The width of a refracted lobe, `alpha |ior - 1|` in radians, below which it is perfect: directions of 24 bits
/// do not resolve it.
pub(crate) const NARROW_BELOW: f32 = 2.0e-5;
/// The cosine below which a direction counts as lying in the surface.
#[doc(hidden)]
pub const COS_MIN: f32 = 1.0e-6;
/// The largest index of refraction, which the host sees to: directions lose precision with its square.
pub const IOR_MAX: f32 = 10.0;
