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
//! subtracts it: [`single_profile`], [`Multiple`]. Who knows how thick the body is takes the rest to that: [`Thickness`].
//!
//! ```
//! use restir_shared::diffusion::{Disk, DiskNumbers, Profile, Shape};
//! use restir_shared::glam::{Vec3, Vec4};
//! use restir_shared::medium::Medium;
//!
//! // cream: its colour, and its mean free paths in millimetres
//! let cream = Medium::of_color(Vec3::new(0.976, 0.9, 0.725), Vec3::new(15.03, 4.66, 2.54), 0.0);
//! let disk = Disk::new(Vec3::ZERO, Vec3::Z, Profile::of_medium(&cream, Shape::Diffuse));
//!
//! // random numbers for the axis, the channel, the radius and the angle
//! let numbers = DiskNumbers::new(Vec4::new(0.3, 0.1, 0.6, 0.2), &disk.profile);
//! let segment = disk.segment(&numbers);
//!
//! // a plane is met once; of a scene, `Probe::probe` gives the points
//! let t = segment.origin.z / -segment.direction.z;
//! let point = segment.origin + segment.direction * t;
//! let (weight, density) = disk.weight(point, Vec3::Z);
//! assert!(density > 0.0 && weight.max_element() <= 12.0);
//!
//! // the numbers of the point, as this axis and channel have them
//! let (back, _) = disk.invert(point, Vec3::Z, 0.1);
//! assert!((back.radius - numbers.radius).abs() < 1.0e-5 && (back.turn - numbers.turn).abs() < 1.0e-5);
//! ```

mod albedo;
mod disk;
mod entry;
mod multiple;
mod profile;
mod radial;
mod shape;
mod thickness;

pub use albedo::{ALBEDO_SLOPE, diffuse_albedo};
pub use disk::{Disk, DiskNumbers, Support};
pub use entry::disney_transmission;
pub use multiple::{Multiple, Remainder, single_profile};
pub use profile::Profile;
pub use radial::{REACH, TAIL, ccdf, cdf, invert_radius, radial_profile, sample_radius};
pub use shape::Shape;
pub use thickness::{Depth, Thickness, thickness};
