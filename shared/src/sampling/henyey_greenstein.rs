//! Directions by the phase function of Henyey and Greenstein (1941).
//!
//! With g the anisotropy and c the cosine between the old and the new direction of travel, the density per steradian is
//! `(1 - g^2) / (4 pi (1 + g^2 - 2 g c)^(3/2))`. Its textbook inversion divides by g and subtracts numbers that are almost equal; here
//! `1 - c` and `1 + c` are products of positive terms, one formula for all g: to change the sign of the map at small g, as common
//! code does, would make a replayed number another direction.

use super::{azimuth, to_unit};
use crate::num::{PI, div, sin_cos, sqrt};
use glam::{Vec2, Vec3};

/// One less and one more than a cosine, both without cancellation.
#[derive(Clone, Copy)]
struct Turn {
    less: f32,
    more: f32,
}

impl Turn {
    #[inline(always)]
    fn of_number(u: f32, g: f32) -> Self {
        let v = 1.0 - u;
        let (d, a, b) = if g >= 0.0 {
            (1.0 - g + 2.0 * g * u, 1.0 + g * u, 1.0 - g + g * u)
        } else {
            (1.0 + g - 2.0 * g * v, 1.0 + g - g * v, 1.0 - g * v)
        };
        let [backward, forward] = [div(1.0 - g, d), div(1.0 + g, d)];
        Self { less: 2.0 * v * (backward * backward) * a, more: 2.0 * u * (forward * forward) * b }
    }

    /// Of a unit vector to +z.
    #[inline(always)]
    fn of_direction(w: Vec3) -> Self {
        let sine_squared = w.x * w.x + w.y * w.y;
        if w.z >= 0.0 {
            let more = 1.0 + w.z;
            Self { less: div(sine_squared, more), more }
        } else {
            let less = 1.0 - w.z;
            Self { less, more: div(sine_squared, less) }
        }
    }

    /// The root of `1 + g^2 - 2 g c`.
    #[inline(always)]
    fn distance(self, g: f32) -> f32 {
        let (nearest, rest) = if g >= 0.0 { (1.0 - g, 2.0 * g * self.less) } else { (1.0 + g, -2.0 * g * self.more) };
        sqrt(nearest * nearest + rest)
    }
}

/// A direction with density [`henyey_greenstein_pdf`], where light travels along +z, for an anisotropy between -1 and 1. The first number chooses the angle, and its
/// cosine grows with it.
#[inline(always)]
pub fn sample_henyey_greenstein(u: Vec2, anisotropy: f32) -> Vec3 {
    let Turn { less, more } = Turn::of_number(u.x, anisotropy);
    let (sine, (sin, cos)) = (sqrt(less * more), sin_cos(u.y));
    let z = if less < more { 1.0 - less } else { more - 1.0 };
    Vec3::new(sine * cos, sine * sin, z)
}

/// The density per steradian of the unit vector `w`, where light travels along +z. As light is scattered with this density, it is
/// the value of the phase function, too.
#[inline(always)]
pub fn henyey_greenstein_pdf(w: Vec3, anisotropy: f32) -> f32 {
    let q = Turn::of_direction(w).distance(anisotropy);
    div((1.0 - anisotropy) * (1.0 + anisotropy), 4.0 * PI * (q * q * q))
}

/// The numbers of which [`sample_henyey_greenstein`] makes `w`.
#[inline(always)]
pub fn invert_henyey_greenstein(w: Vec3, anisotropy: f32) -> Vec2 {
    let turn = Turn::of_direction(w);
    let q = turn.distance(anisotropy);
    let u = div((1.0 - anisotropy) * turn.more, q * (1.0 + anisotropy + q));
    Vec2::new(to_unit(u), azimuth(w.y, w.x))
}
