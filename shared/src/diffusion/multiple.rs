//! What of a profile has scattered once, and what more often.
//!
//! The part that has scattered once is the profile's first order in the albedo: `R1(r) = albedo A'(0) s(0) / (8 pi l r)
//! (exp(-s(0) r / l) + exp(-s(0) r / (3 l)))` (Zhang and d'Eon 2025, whose slide has lost the albedo, and r in the exponents). What is
//! left is `Rn = R - R1`.

use super::albedo::{ALBEDO_SLOPE, albedo_share};
use super::radial::{INV_8_PI, falloff};
use super::{Shape, diffuse_albedo};
use crate::num::{div, max, min, sqrt};

/// `R1(r)` per area, of a medium's mean free path and albedo.
#[inline(always)]
pub fn single_profile(r: f32, mean_free_path: f32, albedo: f32, shape: Shape) -> f32 {
    let s = shape.of_black();
    let w = falloff(s * div(r, mean_free_path));
    div(INV_8_PI * ALBEDO_SLOPE * (albedo * s) * (w * (1.0 + w * w)), mean_free_path * r)
}

/// What is done where the fit of a profile is below that of its first order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum Remainder {
    /// Nothing: with [`Shape::Searchlight`] it is negative nearer than a tenth of a mean free path for albedos above 0.284. Of the three
    /// this one alone adds up to the profile everywhere.
    Signed,
    /// As [`Self::Signed`], zero where that is negative, and less elsewhere, so that as much light comes out in all, to 2e-4.
    Clamped,
    /// With [`Shape::Diffuse`], which is above its first order at all distances and for all albedos.
    #[default]
    Diffuse,
}

impl Remainder {
    /// The shape of the profile.
    #[inline(always)]
    pub fn shape(self) -> Shape {
        if self == Self::Diffuse { Shape::Diffuse } else { Shape::Searchlight }
    }
}

/// The part of a channel's profile that has scattered more than once, by the distance.
#[derive(Clone, Copy, Debug)]
pub struct Multiple {
    /// What has scattered once, at the distance zero.
    single: f32,
    shape: f32,
    of_black: f32,
    scale: f32,
    /// No less than this is left.
    least: f32,
}

impl Multiple {
    /// That part of the profile of a medium; `absorbed` is one less `albedo`.
    #[inline(always)]
    pub fn new(albedo: f32, absorbed: f32, anisotropy: f32, remainder: Remainder) -> Self {
        let shape = remainder.shape();
        let factor = shape.factor(diffuse_albedo(albedo, absorbed, anisotropy));
        let clamped = remainder == Remainder::Clamped;
        Self {
            single: div(ALBEDO_SLOPE * shape.of_black(), albedo_share(absorbed, anisotropy) * factor),
            shape: factor,
            of_black: shape.of_black(),
            // lavapipe makes a minus zero of the choice between -1 and 0
            least: if remainder == Remainder::Signed { -2.0 } else { 0.0 },
            scale: if clamped { kept(sqrt(absorbed)) } else { 1.0 },
        }
    }

    /// `Rn / R` at a distance in mean free paths: at most 1, and above -1. The profile's pole is not in it.
    #[inline(always)]
    pub fn share(&self, x: f32) -> f32 {
        let (once, all) = (falloff(self.of_black * x), falloff(self.shape * x));
        let nearer = falloff((self.of_black - self.shape) * x);
        let single = self.single * nearer * div(1.0 + once * once, 1.0 + all * all);
        max((1.0 - single) * self.scale, self.least)
    }
}

/// The reciprocal of the root of what a collision absorbs where the albedo is 0.284: blacker media have nothing negative.
const PER_LAST: f32 = 1.0 / 0.846_072_26;

/// Of what is positive the part that is as much as all: a fit, by the root of what a collision absorbs.
#[inline(always)]
fn kept(q: f32) -> f32 {
    let z = min(q * PER_LAST, 1.0);
    let up = 1.0 - z;
    let fit = 0.002_645 + z * (0.060_791 + z * (-0.184_135 + z * (2.788_271 + z * (-5.957_674 + z * 4.106_971))));
    1.0 - up * up * up * fit
}
