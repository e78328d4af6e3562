//! What a body that ends leaves of a half space's profile.
//!
//! A profile is that of a half space. Where a body is thin, light leaves it on the far side before it has collided often: less comes back than
//! the profile says, and more comes out far away. Across a gap of air no light goes inside. Two factors take the part of a profile that has
//! collided more than once ([`Multiple`](super::Multiple)) from half spaces to bodies:
//!
//! * what is [kept](Thickness::kept) of it, by the [thickness] that light would cross in the direction in which it entered;
//! * what a pair of points [gains](Thickness::gain) or loses by its [`Depth`].
//!
//! Both are fits of this library, for light that enters by Lambert's law, to slabs of 1/16 to 16 mean free paths and walks beside edges and in corners, of
//! albedos of 0.05 to 0.9999. The first has the form of the two-flux theory of a layer (Kubelka and Munk 1931). Hybrids trace the ray that measures
//! the thickness for their boundary term (Zhang and d'Eon 2025, who leave their profile as it is).

use super::albedo::root_absorbed;
use crate::num::{div, expm1, max, min};
use crate::vec::dot;
use glam::Vec3;

/// Thicker bodies are half spaces, in mean free paths.
const THICKEST: f32 = 256.0;
/// The least share by which surfaces face each other: where they do less, the body counts as this much thicker squared.
const LEAST_FACING: f32 = 1.0 / 32.0;
/// The least root of what a collision absorbs: in whiter media nothing changes over [`THICKEST`].
const LEAST_ABSORBED: f32 = 1.0 / 1024.0;
/// One over the depth, in mean free paths, at which the growth of a gain has fallen to half of a straight line's.
const PER_HALF_GAIN: f32 = 1.0 / 12.0;
/// How fast light is lost by the height over a corner, per mean free path.
const AIR: f32 = 0.5;

/// How thick a body counts, in units of the scene, which light has crossed over a `distance`, between surfaces whose outer normals have this cosine.
///
/// That is the distance where both are parallel, as a slab's are, and more where they turn to each other: a ball keeps more light than a slab as
/// thick. The power of two is a fit to balls of 1/4 to 8 mean free paths.
#[inline(always)]
pub fn thickness(distance: f32, cos_normals: f32) -> f32 {
    let facing = max(0.5 - 0.5 * cos_normals, LEAST_FACING);
    div(distance, facing * facing)
}

/// How two points of a body lie to each other.
#[derive(Clone, Copy, Debug)]
pub struct Depth {
    /// How far each lies below the tangent plane of the other at least, in units of the scene; negative if both lie above it, as across a gap of air, by as much at
    /// least; 0 if only one does.
    pub below: f32,
    /// What is let past an edge in the air: by the angle of the normals, 1 of parallel ones, 0 of those that face each other.
    pub open: f32,
}

impl Depth {
    /// Of two points with a `way` from the first to the second, and their outer unit normals.
    #[inline(always)]
    pub fn new(way: Vec3, first: Vec3, second: Vec3) -> Self {
        let (one, other) = (-dot(way, first), dot(way, second));
        let below = max(min(one, other), 0.0) + min(max(one, other), 0.0);
        Self { below, open: 0.5 + 0.5 * dot(first, second) }
    }
}

/// How a channel's profile depends on the thickness of a body.
///
/// ```
/// use restir_shared::diffusion::Thickness;
///
/// // white media need thick bodies: a layer of two mean free paths keeps this much of what a half space sends back
/// let [white, gray] = [0.01, 0.2].map(|absorbed| Thickness::new(absorbed, 0.0).kept(2.0));
/// assert!(white < 0.5 && gray > 0.8);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Thickness {
    /// The root of what a collision absorbs, by similarity.
    q: f32,
}

impl Thickness {
    /// Of a medium of this anisotropy whose collisions absorb so much.
    #[inline(always)]
    pub fn new(absorbed: f32, anisotropy: f32) -> Self {
        Self { q: max(root_absorbed(absorbed, anisotropy), LEAST_ABSORBED) }
    }

    /// The part of multiple scattering that comes back of a body so many mean free paths thick, in [0, 1], of what a half space sends back. Its mean over
    /// the directions of Lambert's law is that of a slab to 0.035.
    #[inline(always)]
    pub fn kept(&self, thickness: f32) -> f32 {
        let (q, x) = (self.q, min(thickness, THICKEST));
        let decay = q * (4.29 - 1.62 * q);
        let black = decay * (3.06 - 1.82 * q);
        let lost = -expm1(-decay * div(x * x, x + (0.31 - 0.21 * q)));
        div(lost, black + (1.0 - black) * lost)
    }

    /// By what a profile is multiplied between two points of a medium of this extinction: more than 1 where both lie below each other's tangent plane,
    /// less where both lie above it.
    #[inline(always)]
    pub fn gain(&self, depth: &Depth, extinction: f32) -> f32 {
        let x = depth.below * extinction;
        let (below, above) = (max(x, 0.0), 1.0 + max(-x, 0.0) * AIR);
        let more = 1.0 + div(max(0.09 + 1.1 * self.q, 0.17) * below, 1.0 + below * PER_HALF_GAIN);
        if x < 0.0 { div(depth.open, above * above) } else { more }
    }
}
