//! The profile of three colour channels.

use super::radial::{INV_8_PI, NEAREST, falloff};
use super::{REACH, Shape, diffuse_albedo};
use crate::medium::Medium;
use crate::num::{div, max, min, recip};
use glam::Vec3;

/// Distances below this count as this where they are divided by; a profile is not so high that it would matter.
const NOWHERE: f32 = 1.0e-30;
const PER_NEAREST: f32 = 1.0 / NEAREST;

/// Diffusion profiles of three channels, and with which probability each of them gives the radius of a sample.
///
/// A channel whose `distance` is zero has no profile. What each channel has ends at its own [`Self::reach`]: a density of samples that
/// ended nearer than the profile of some channel would leave light that no sample finds, or that few find with large weights.
#[derive(Clone, Copy, Debug)]
pub struct Profile {
    /// Diffuse albedo, in [0, 1].
    pub albedo: Vec3,
    /// `d`, not negative.
    pub distance: Vec3,
    /// Probabilities of the channels, whose sum is 1; zero for those without a profile, and for no others with an albedo.
    pub probability: Vec3,
}

impl Profile {
    /// Each channel with a profile is as probable as the others.
    #[inline(always)]
    pub fn new(albedo: Vec3, distance: Vec3) -> Self {
        let is_there = |distance: f32| if distance > 0.0 { 1.0 } else { 0.0 };
        Self::weighted(albedo, distance, Vec3::new(is_there(distance.x), is_there(distance.y), is_there(distance.z)))
    }

    /// Each channel with a profile has the probability of its share in the albedo.
    #[inline(always)]
    pub fn by_albedo(albedo: Vec3, distance: Vec3) -> Self {
        let weight = |albedo: f32, distance: f32| if distance > 0.0 { albedo } else { 0.0 };
        let weights =
            Vec3::new(weight(albedo.x, distance.x), weight(albedo.y, distance.y), weight(albedo.z, distance.z));
        Self::weighted(albedo, distance, weights)
    }

    #[inline(always)]
    fn weighted(albedo: Vec3, distance: Vec3, weights: Vec3) -> Self {
        let sum = weights.x + weights.y + weights.z;
        Self { albedo, distance, probability: weights * if sum > 0.0 { recip(sum) } else { 0.0 } }
    }

    /// The profile of a half space of a medium.
    #[inline(always)]
    pub fn of_medium(medium: &Medium, shape: Shape) -> Self {
        let Medium { albedo, absorbed, extinction, anisotropy } = *medium;
        let reflected = Vec3::new(
            diffuse_albedo(albedo.x, absorbed.x, anisotropy),
            diffuse_albedo(albedo.y, absorbed.y, anisotropy),
            diffuse_albedo(albedo.z, absorbed.z, anisotropy),
        );
        let distance = |extinction: f32, albedo: f32| div(1.0, extinction * shape.factor(albedo));
        Self::new(
            reflected,
            Vec3::new(
                distance(extinction.x, reflected.x),
                distance(extinction.y, reflected.y),
                distance(extinction.z, reflected.z),
            ),
        )
    }

    /// With the channels alone for which `kept` is 1 and not 0.
    #[inline(always)]
    #[must_use]
    pub fn of_channels(&self, kept: Vec3) -> Self {
        Self::weighted(self.albedo, self.distance * kept, self.probability * kept)
    }

    /// With probabilities in proportion to the albedo.
    #[inline(always)]
    #[must_use]
    pub fn chosen_by_albedo(&self) -> Self {
        Self::by_albedo(self.albedo, self.distance)
    }

    /// Where each channel ends.
    #[inline(always)]
    pub fn reach(&self) -> Vec3 {
        self.distance * REACH
    }

    /// What of the light that enters at a distance leaves, per area: zero beyond each channel's reach.
    #[inline(always)]
    pub fn at(&self, r: f32) -> Vec3 {
        self.albedo * self.within(r, Channels::new(self).at(r))
    }

    /// `values` of the channels that reach as far, zero of the others.
    #[inline(always)]
    pub(super) fn within(&self, r: f32, values: Vec3) -> Vec3 {
        let reach = self.reach();
        let kept = |reach: f32, value: f32| if r <= reach { value } else { 0.0 };
        Vec3::new(kept(reach.x, values.x), kept(reach.y, values.y), kept(reach.z, values.z))
    }
}

/// What the channels of a profile are evaluated by, so that a distance takes one division.
#[derive(Clone, Copy)]
pub(super) struct Channels {
    /// 1 / d; 0 without a profile.
    per_distance: Vec3,
}

impl Channels {
    #[inline(always)]
    pub(super) fn new(profile: &Profile) -> Self {
        let inverse = |d: f32| if d > 0.0 { recip(max(d, NOWHERE)) } else { 0.0 };
        let Vec3 { x, y, z } = profile.distance;
        Self { per_distance: Vec3::new(inverse(x), inverse(y), inverse(z)) }
    }

    /// `Rd` of each channel.
    #[inline(always)]
    pub(super) fn at(&self, r: f32) -> Vec3 {
        let per_r = recip(max(r, NOWHERE));
        let of = |per_distance: f32| {
            let w = falloff(r * per_distance);
            // the profile at `NEAREST` d, if that is farther
            w * (1.0 + w * w) * (INV_8_PI * per_distance) * min(per_r, PER_NEAREST * per_distance)
        };
        Vec3::new(of(self.per_distance.x), of(self.per_distance.y), of(self.per_distance.z))
    }
}
