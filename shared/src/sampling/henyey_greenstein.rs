//! Directions by the phase function of Henyey and Greenstein (1941).
//!
//! With g the anisotropy and c the cosine between the old and the new direction of travel, the density per steradian is
//! `(1 - g^2) / (4 pi (1 + g^2 - 2 g c)^(3/2))`. Its textbook inversion divides by g and subtracts numbers that are almost equal; here
//! `1 - c` and `1 + c` are products of positive terms, one formula for all g: to change the sign of the map at small g, as common
//! code does, would make a replayed number another direction.

use super::{azimuth, to_unit};
use crate::num::{PI, div, sin_cos, sqrt};
use crate::vec::dot;
use glam::{Vec2, Vec3};

/// One less and one more than a cosine, both without cancellation.
#[derive(Clone, Copy)]
struct Turn {
    less: f32,
    more: f32,
}

/// `(1 - g^2) / q`, where q is the root of `1 + g^2 - 2 g c` for the cosine c that is made of the number u.
#[inline(always)]
fn spread(u: f32, g: f32) -> f32 {
    if g >= 0.0 { 1.0 - g + 2.0 * g * u } else { 1.0 + g - 2.0 * g * (1.0 - u) }
}

impl Turn {
    #[inline(always)]
    fn of_number(u: f32, g: f32) -> Self {
        let v = 1.0 - u;
        let (a, b) = if g >= 0.0 { (1.0 + g * u, 1.0 - g + g * u) } else { (1.0 + g - g * v, 1.0 - g * v) };
        let d = spread(u, g);
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

    /// Between two unit vectors.
    #[inline(always)]
    fn between(a: Vec3, b: Vec3) -> Self {
        let (apart, together) = (a - b, a + b);
        Self { less: 0.5 * dot(apart, apart), more: 0.5 * dot(together, together) }
    }

    /// The density per steradian.
    #[inline(always)]
    fn pdf(self, g: f32) -> f32 {
        let q = self.distance(g);
        div((1.0 - g) * (1.0 + g), 4.0 * PI * (q * q * q))
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
    Turn::of_direction(w).pdf(anisotropy)
}

/// The density of what [`sample_henyey_greenstein`] makes of a first number, over [`henyey_greenstein_scale`].
#[inline(always)]
pub fn henyey_greenstein_shape(u: f32, anisotropy: f32) -> f32 {
    let d = spread(u, anisotropy);
    d * d * d
}

/// What all densities of an anisotropy have in common, in terms of numbers: `1 / (4 pi (1 - g^2)^2)`.
#[inline(always)]
pub fn henyey_greenstein_scale(anisotropy: f32) -> f32 {
    let whole = (1.0 - anisotropy) * (1.0 + anisotropy);
    div(1.0, 4.0 * PI * (whole * whole))
}

/// [`henyey_greenstein_pdf`] between any two unit vectors along which light travels.
#[inline(always)]
pub fn henyey_greenstein_between(from: Vec3, to: Vec3, anisotropy: f32) -> f32 {
    Turn::between(from, to).pdf(anisotropy)
}

/// The numbers of which [`sample_henyey_greenstein`] makes `w`.
#[inline(always)]
pub fn invert_henyey_greenstein(w: Vec3, anisotropy: f32) -> Vec2 {
    let turn = Turn::of_direction(w);
    let q = turn.distance(anisotropy);
    let u = div((1.0 - anisotropy) * turn.more, q * (1.0 + anisotropy + q));
    Vec2::new(to_unit(u), azimuth(w.y, w.x))
}
