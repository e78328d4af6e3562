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

// how walks choose distances by channel
#[doc(hidden)]
pub use distance::{Channels, transmittance};
pub use interior::Interior;

use crate::num::{clamp, div, max, sqrt};
use glam::Vec3;

/// The largest magnitude of an anisotropy.
#[doc(hidden)]
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

/// The albedo of [`Medium::of_color`] alone.
#[doc(hidden)]
#[inline(always)]
pub fn albedo_of_color(color: Vec3, anisotropy: f32) -> Vec3 {
    of_each::<0>(color, anisotropy)
}

/// What is absorbed by the medium of [`Medium::of_color`] alone.
#[inline(always)]
pub(crate) fn absorbed_of_color(color: Vec3, anisotropy: f32) -> Vec3 {
    of_each::<1>(color, anisotropy)
}

/// A part of [`collision`] for each channel, by one call site: it takes much code.
#[inline(always)]
fn of_each<const PART: usize>(color: Vec3, anisotropy: f32) -> Vec3 {
    let mut parts = Vec3::ZERO;
    let mut channel = 0;
    while channel < 3 {
        let of = if channel == 0 {
            color.x
        } else if channel == 1 {
            color.y
        } else {
            color.z
        };
        let part = collision(of, anisotropy)[PART];
        parts = Vec3::new(
            if channel == 0 { part } else { parts.x },
            if channel == 1 { part } else { parts.y },
            if channel == 2 { part } else { parts.z },
        );
        channel += 1;
    }
    parts
}

/// The colour without an interface ([`Medium::of_color`]) of the medium whose half space behind a smooth dielectric has the colour `color`, in
/// [0, 1]: the part of light that leaves again, of light that has entered by Lambert's law; `index` is the relative index of refraction, from 1 to 1.8.
///
/// Behind a dielectric, which keeps much of the light that would leave, the same medium is darker. The fit is van de Hulst's form with other constants,
/// functions of what the interface reflects of diffuse light from inside (Egan and Hilgeman 1973); walks give colours from 0.05 on again within 2 %, and within
/// 3 % beyond an index of 1.6.
#[doc(hidden)]
pub fn color_behind(color: f32, index: f32) -> f32 {
    if index <= 1.0 {
        return clamp(color, 0.0, 1.0);
    }
    let inverse = div(1.0, index);
    let leaves = 0.3319 - 0.0636 * index - inverse * (0.7099 - 1.4399 * inverse);
    let cube = leaves * leaves * leaves;
    let near_one = cube * cube;
    let (a, b) = (0.264 - 0.125 * near_one, div(2.424, leaves) - 1.48 + 0.226 * near_one);
    let c = clamp(color, 0.0, 1.0);
    let sum = 1.0 + a + b * c;
    let s = div(2.0 * (1.0 - c), sum + sqrt(max(sum * sum - 4.0 * a * (1.0 - c), 0.0)));
    div((1.0 - s) * (1.0 - 0.139 * s), 1.0 + 1.17 * s)
}

impl Medium {
    /// The colour that [`Self::of_color`] makes the medium of.
    #[inline(always)]
    pub fn color(&self) -> Vec3 {
        let color = |albedo: f32, absorbed: f32| {
            let g = self.anisotropy;
            let s = sqrt(div(absorbed, (1.0 - g) + g * absorbed));
            // 1 - s^2 = albedo (1 - g) / (1 - g albedo)
            let one_less_s = div(albedo * (1.0 - g), ((1.0 - g) + g * absorbed) * (1.0 + s));
            div(one_less_s * (1.0 - 0.139 * s), 1.0 + 1.17 * s)
        };
        let (albedo, absorbed) = (self.albedo, self.absorbed);
        Vec3::new(color(albedo.x, absorbed.x), color(albedo.y, absorbed.y), color(albedo.z, absorbed.z))
    }
}

/// What a collision scatters and absorbs in a half space of the diffuse albedo `color`.
///
/// Van de Hulst's approximation is `color = (1 - S)(1 - 0.139 S) / (1 + 1.17 S)`, where `S^2 = (1 - albedo) / (1 - g albedo)`. Its root, which
/// Kulla and Conty (2017) and Cycles take as well, is written without the difference that cancels near white; `1 - S`, which cancels near
/// black, comes from the approximation itself, and so does `1 - g S^2`.
#[inline(always)]
fn collision(color: f32, anisotropy: f32) -> [f32; 2] {
    let c = clamp(color, 0.0, 1.0);
    let b = 1.139 + 1.17 * c;
    let s = div(2.0 * (1.0 - c), b + sqrt(b * b - 0.556 * (1.0 - c)));
    let one_less_s = div(c * (1.0 + 1.17 * s), 1.0 - 0.139 * s);
    let one_less_s2 = one_less_s * (1.0 + s);
    let scale = (1.0 - anisotropy) + anisotropy * one_less_s2;
    [clamp(div(one_less_s2, scale), 0.0, 1.0), div(s * s * (1.0 - anisotropy), scale)]
}
