//! Light that comes out of a scattering object beside where it went in, without a walk: diffusion profiles, and points of the surface
//! at which to ask for the light that goes in.
//!
//! A profile `R(r)` is the part of the light that enters at a point which leaves per area at the distance `r`. In a half space it is
//! close to `A` times
//!
//! `Rd(r; d) = (exp(-r / d) + exp(-r / (3 d))) / (8 pi d r)`, `d = l / s(A)`
//!
//! (Christensen and Burley 2015), whose integral over the plane is 1. `A` is the [diffuse albedo](diffuse_albedo), `l` the mean free path,
//! and `s` a [shape factor](Shape). Each colour channel has an `A` and a `d` of its own ([`Profile`]). Everything ends at the
//! distance [`REACH`] `d`, within which all but a thousandth of the light comes out.
//!
//! Points are found by a disk ([`Disk`]; King et al. 2013): a channel gives a radius, an axis out of three a direction, and a
//! segment through the sphere that bounds the profile gives all places where it [meets the object](crate::scene::Probe).
//! The density of a point is that of all axes and channels that can find it.
//!
//! A profile holds light that has scattered any number of times. Who finds light that has scattered once by other means
//! subtracts it: [`single_profile`], [`Multiple`].

mod albedo;
mod disk;
mod entry;
mod multiple;
mod profile;
mod radial;
mod shape;

pub use albedo::{ALBEDO_SLOPE, diffuse_albedo};
pub use disk::{Disk, DiskNumbers, Support};
pub use entry::disney_transmission;
pub use multiple::{Multiple, Remainder, single_profile};
pub use profile::Profile;
pub use radial::{REACH, TAIL, ccdf, cdf, invert_radius, radial_profile, sample_radius};
pub use shape::Shape;
