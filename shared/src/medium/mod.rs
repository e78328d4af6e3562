//! Homogeneous media that scatter and absorb light: their coefficients, how far light goes in them, and where it turns.
//!
//! The *extinction* of a medium is the expected number of collisions per unit length, and its *albedo* the part of a collision that is
//! scattered; the rest is absorbed. Of light that travels a distance t the part `exp(-extinction t)` has not collided (Beer and Lambert).
//! Each colour channel has coefficients of its own; directions turn alike in all of them
//! ([`sample_henyey_greenstein`](crate::sampling::sample_henyey_greenstein)).
//!
//! ```
//! use restir_shared::glam::{Vec2, Vec3};
//! use restir_shared::medium::{Channels, Medium, transmittance};
//!
//! // a medium by the colour of its surface, and by the mean free path of light in it: green goes farthest
//! let medium = Medium::of_color(Vec3::new(0.2, 0.8, 0.4), Vec3::new(1.0, 4.0, 2.0), 0.0);
//! assert!(medium.albedo.y > medium.albedo.z && medium.albedo.z > medium.albedo.x);
//! assert!((transmittance(medium.extinction, 4.0).y - (-1.0_f32).exp()).abs() < 1e-6);
//!
//! // distances to collisions: the mean of what passes a slab of thickness 2, over uniform numbers, is its transmittance
//! let channels = Channels::new(medium.extinction, medium.albedo);
//! let mut passed = Vec3::ZERO;
//! for i in 0..4096 {
//!     let u = Vec2::new((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5) / 64.0;
//!     passed += if channels.sample(u) > 2.0 { channels.passed(2.0) / 4096.0 } else { Vec3::ZERO };
//! }
//! assert!((passed - transmittance(medium.extinction, 2.0)).length() < 0.02);
//! ```

mod distance;
mod interior;

pub use distance::{Channels, transmittance};
pub use interior::Interior;

use crate::num::{clamp, div, sqrt};
use glam::Vec3;

/// The largest magnitude of an anisotropy.
pub const MAX_ANISOTROPY: f32 = 0.999;

/// A homogeneous medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Expected number of collisions per unit length, by channel; the reciprocal of the mean free path.
    pub extinction: Vec3,
    /// The part of a collision that is scattered, in [0, 1].
    pub albedo: Vec3,
    /// The part that is absorbed: one less [`Self::albedo`], which would lose its digits where next to nothing is absorbed.
    pub absorbed: Vec3,
    /// Mean cosine of the angle by which light turns, of magnitude at most [`MAX_ANISOTROPY`].
    pub anisotropy: f32,
}

impl Medium {
    /// The medium whose half space, entered and left by Lambert's law without any interface, reflects the part `color` of light, in
    /// [0, 1], and of which light travels `mean_free_path` > 0 between two collisions, by channel.
    pub fn of_color(color: Vec3, mean_free_path: Vec3, anisotropy: f32) -> Self {
        let anisotropy = clamp(anisotropy, -MAX_ANISOTROPY, MAX_ANISOTROPY);
        let [red, green, blue] = color.to_array().map(|color| collision(color, anisotropy));
        Self {
            extinction: Vec3::from_array(mean_free_path.to_array().map(|mean| div(1.0, mean))),
            albedo: Vec3::new(red[0], green[0], blue[0]),
            absorbed: Vec3::new(red[1], green[1], blue[1]),
            anisotropy,
        }
    }
}

/// What a collision scatters and absorbs in a half space of the diffuse albedo `color`.
///
/// Van de Hulst's approximation is `color = (1 - S)(1 - 0.139 S) / (1 + 1.17 S)`, where `S^2 = (1 - albedo) / (1 - g albedo)`. Its root, which
/// Kulla and Conty (2017) and Cycles take as well, is written without the difference that cancels near white; `1 - S`, which cancels near
/// black, comes from the approximation itself, and so does `1 - g S^2`.
fn collision(color: f32, anisotropy: f32) -> [f32; 2] {
    let c = clamp(color, 0.0, 1.0);
    let b = 1.139 + 1.17 * c;
    let s = div(2.0 * (1.0 - c), b + sqrt(b * b - 0.556 * (1.0 - c)));
    let one_less_s = div(c * (1.0 + 1.17 * s), 1.0 - 0.139 * s);
    let one_less_s2 = one_less_s * (1.0 + s);
    let scale = (1.0 - anisotropy) + anisotropy * one_less_s2;
    [clamp(div(one_less_s2, scale), 0.0, 1.0), div(s * s * (1.0 - anisotropy), scale)]
}
