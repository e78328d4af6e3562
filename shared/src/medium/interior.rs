//! What is inside of things.

use super::Medium;
use crate::vec::max_component;
use glam::Vec3;

/// What a surface encloses, at one of its points: a homogeneous medium that absorbs and may scatter, or nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interior {
    /// The surface encloses something. Any other is a sheet: on both of its sides is what is around it.
    pub closed: bool,
    /// It holds a medium that may scatter, here or elsewhere.
    pub filled: bool,
    /// Which body it is, an object of the scene: from inside its front cannot be met.
    pub body: u32,
    /// What lies around the body, which is where light is that leaves it: one more than the index of a triangle of the body that encloses it; 0 if
    /// none does.
    pub around: u32,
    /// Expected number of collisions per unit length, by channel.
    pub extinction: Vec3,
    /// The part of a collision that is scattered, in [0, 1], by channel; black of an interior that absorbs alone.
    pub albedo: Vec3,
    /// Mean cosine of the angle by which light turns ([`crate::sampling::sample_henyey_greenstein`]).
    pub anisotropy: f32,
    /// The constant factor of a turn's density ([`crate::sampling::henyey_greenstein_scale`]).
    pub turn_scale: f32,
    /// Light that reaches the surface from inside is mirrored as by a smooth interface to a medium that is denser by this relative index: never
    /// totally. 1 does nothing. No real interface is like that; published fits of reflectance are of it (Zhang and d'Eon 2025). 0 is a clear border
    /// ([`Self::is_clear`]).
    pub denser_outside: f32,
    /// By how much refraction at the surface makes radiance inside larger than outside: the square of the index of a dielectric. Roulette
    /// asks for it, for light that goes out again loses it again.
    pub gain: f32,
    /// As [`crate::scene::SurfacePoint::offset`].
    pub offset: f32,
    /// Lights may lie inside, or shine in through a clear border, so that it pays to sample them there. What is found does not depend on it, but for noise
    /// and punctual lights.
    pub lit: bool,
}

impl Interior {
    /// Nothing, behind a surface that encloses nothing.
    pub const NONE: Self = Self {
        closed: false,
        filled: false,
        body: u32::MAX,
        around: 0,
        extinction: Vec3::ZERO,
        albedo: Vec3::ZERO,
        anisotropy: 0.0,
        denser_outside: 1.0,
        turn_scale: 1.0,
        gain: 1.0,
        offset: 0.0,
        lit: false,
    };

    /// What scatters, but is not known yet: no light is sampled there.
    pub(crate) const UNKNOWN: Self = Self { albedo: Vec3::ONE, ..Self::NONE };

    /// The extinction of what scatters; what does not absorbs by another rule ([`crate::transport::through_interior`]).
    #[inline(always)]
    pub fn scattering(&self) -> Vec3 {
        if self.scatters() { self.extinction } else { Vec3::ZERO }
    }

    /// What fills it, and absorbs the part [`crate::scene::Surface::absorbed`] of a collision.
    #[inline(always)]
    pub fn medium(&self, absorbed: Vec3) -> Medium {
        let Self { extinction, albedo, anisotropy, .. } = *self;
        Medium { extinction, albedo, absorbed, anisotropy }
    }

    /// Whether light passes the surface straight and undimmed, so that lights can be sampled through it.
    #[doc(hidden)]
    #[inline(always)]
    pub fn is_clear(&self) -> bool {
        self.denser_outside <= 0.0
    }

    /// Whether light is scattered.
    #[doc(hidden)]
    #[inline(always)]
    pub fn scatters(&self) -> bool {
        max_component(self.albedo) > 0.0
    }
}
