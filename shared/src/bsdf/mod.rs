//! Scattering functions in the frame of the surface: +z is the shading normal on the side of the viewer, and all
//! directions point away from the surface.
//!
//! A [`Material`] is glTF's metallic-roughness model with its transmission extensions. For one direction to the
//! viewer it becomes a [`Bsdf`]: a weighted mixture of four lobes. With metalness m, T = (1 - m) transmission and
//! P = (1 - m)(1 - transmission) they are
//!
//! | lobe | value |
//! |---|---|
//! | [`DIFFUSE_REFLECTION`] | `P (1 - d) base / pi (1 - Fs(cos_o)) (1 - Fs(cos_i))`, d the diffuse transmission |
//! | [`DIFFUSE_TRANSMISSION`] | `P d color / pi (1 - Fs(cos_o)) (1 - Fs(cos_i))` |
//! | [`SPECULAR_REFLECTION`] | `D G2 (f0 + (f90 - f0)(1 - o.h)^5 + T F) / (4 cos_o cos_i)` |
//! | [`SPECULAR_TRANSMISSION`] | `T base (1 - F) D G2 abs(o.h i.h) no^2 / (cos_o cos_i (ni i.h + no o.h)^2)` |
//!
//! where D and G2 are GGX with Smith's height-correlated masking (Walter et al. 2007, eq. 33; Heitz 2014, eq. 99; Walter's
//! eq. 21 for the transmission), F is Fresnel's reflectance of a dielectric, `Fs` Schlick's approximation with
//! `f0s = ((ior - 1) / (ior + 1))^2` and 1, `f0 = m base + P f0s`, and `f90 = m + P`; with `ior = 1` P has no
//! specular part (`Fs = 0`, `f90 = m`), and what is left is Lambert's law.
//!
//! * The diffuse lobes are coupled to the specular one as in Ashikhmin and Shirley 2000, by the product of what enters
//!   and what leaves. glTF's own weight `1 - Fs(v.h)` gains energy at grazing angles, up to a factor of nearly 2.
//!   The coupling knows no roughness: rough plastic darkens at grazing angles, to an albedo below 0.1 at cosine 0.005.
//! * The transmission scales **radiance** by (no / ni)^2, as paths from the camera need; there is no such factor where
//!   a material is `thin`: then light goes straight through, spread by D as if mirrored at the surface.
//! * Scattering is single: light that a facet sends to another one is lost. A white conductor, seen from above, keeps
//!   0.99 of the energy at roughness 0.3, 0.92 at 0.5, 0.70 at 0.7, and 1 - ln 2 = 0.31 at 1.
//! * Below roughness [`DELTA_BELOW`] the specular lobes are perfect (deltas); so is a transmission lobe that
//!   refraction makes narrower than [`NARROW_BELOW`], as where the indices of both sides are almost equal.
//! * A cosine below [`COS_MIN`] counts as zero in value, density and sampling alike.

mod fresnel;
mod ggx;
mod material;
mod mixture;

pub use fresnel::{Dielectric, Fresnel, schlick_complement, schlick_weight};
pub use ggx::{Facet, Ggx};
pub use material::Material;
pub use mixture::{Bsdf, BsdfSample, Evaluation, Kind, is_specular, is_transmission};

/// Lobe: diffuse reflection.
pub const DIFFUSE_REFLECTION: u32 = 0;
/// Lobe: diffuse transmission.
pub const DIFFUSE_TRANSMISSION: u32 = 1;
/// Lobe: specular reflection, rough or perfect.
pub const SPECULAR_REFLECTION: u32 = 2;
/// Lobe: specular transmission, rough or perfect.
pub const SPECULAR_TRANSMISSION: u32 = 3;
/// Number of lobes.
pub const LOBES: u32 = 4;

/// The perceptual roughness below which specular lobes are perfect. GGX's alpha is its square.
pub const DELTA_BELOW: f32 = 0.01;
/// The width of a refracted lobe, `alpha |ior - 1|` in radians, below which it is perfect: directions of 24 bits
/// do not resolve it.
pub const NARROW_BELOW: f32 = 2.0e-5;
/// The cosine below which a direction counts as lying in the surface.
pub const COS_MIN: f32 = 1.0e-6;
/// The largest index of refraction, which the host sees to: directions lose precision with its square.
pub const IOR_MAX: f32 = 10.0;

// Each optional part has a constant that occurs nowhere else: a module that lacks it lacks the part.

/// Occurs where rough specular lobes are compiled in: the least alpha of GGX, just below that of [`DELTA_BELOW`].
pub const GLOSSY_MARKER: f32 = 9.871e-5;
/// Occurs where perfect specular lobes are compiled in: the least selection probability of a delta sample.
pub const DELTA_MARKER: f32 = 1.173e-9;
/// Occurs where dielectric transmission is compiled in: the squared cosine below which reflection is total.
pub const TRANSMISSION_MARKER: f32 = 9.71e-13;
/// Occurs where diffuse transmission is compiled in: smaller shares count as none.
pub const DIFFUSE_TRANSMISSION_MARKER: f32 = 1.307e-7;
