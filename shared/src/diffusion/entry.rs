//! What an interface lets through, of diffusion that was fitted without one.

use crate::num::clamp;

/// `1 - (1 - cos)^5 / 2`: the part of light that Disney's diffuse model lets through at a cosine with the normal (Burley 2015), where
/// it enters and where it leaves. It is 1 along the normal and one half at grazing angles.
///
/// The hybrid does without: there light enters and leaves by Lambert's law or by Fresnel's equations, as in the walk that it is compared
/// with, which knows no such interface. It is for profiles that are measured against other programs.
#[inline(always)]
pub fn disney_transmission(cos: f32) -> f32 {
    let c = clamp(1.0 - cos, 0.0, 1.0);
    let square = c * c;
    1.0 - 0.5 * (square * square * c)
}
