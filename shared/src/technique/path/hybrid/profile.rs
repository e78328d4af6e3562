//! What a profile is where a path enters a body.

use super::params::Fit;
use crate::diffusion::{Disk, DiskNumbers, Multiple, Profile};
use crate::medium::{Interior, Medium};
use crate::rng;
use crate::scene::Location;
use crate::technique::path::PathFlags;
use crate::vec::length;
use glam::{UVec4, Vec3, Vec4};

/// The profile around an entry, less what has scattered once, if that is found elsewhere.
#[derive(Clone, Copy)]
pub(crate) struct EntryProfile {
    /// By which its points are found.
    pub(crate) disk: Disk,
    rest: [Multiple; 3],
    extinction: Vec3,
    /// Reflectance of the channels that are Lambertian.
    pub(crate) lambert: Vec3,
    whole: bool,
}

impl EntryProfile {
    /// At a place where an interior begins that absorbs this part of a collision, after a path of the length `travelled`.
    #[inline(always)]
    pub(crate) fn new(fit: &Fit, at: &Location, (interior, absorbed): (&Interior, Vec3), travelled: f32) -> Self {
        let medium = interior.medium(absorbed);
        let kept = fit.spread(interior, travelled);
        let profile = Profile::of_medium(&medium, fit.shape()).of_channels(kept);
        let profile = if fit.has(PathFlags::BY_ALBEDO) { profile.chosen_by_albedo() } else { profile };
        let disk = Disk { support: fit.support(), ..Disk::new(at.position, at.normal, profile) };
        let Medium { albedo, absorbed, extinction, anisotropy } = medium;
        let rest = |albedo: f32, absorbed: f32| Multiple::new(albedo, absorbed, anisotropy, fit.remainder());
        Self {
            disk,
            rest: [rest(albedo.x, absorbed.x), rest(albedo.y, absorbed.y), rest(albedo.z, absorbed.z)],
            extinction,
            lambert: medium.color() * (Vec3::ONE - kept),
            whole: fit.has(PathFlags::WHOLE),
        }
    }

    /// The numbers of one of several segments. The axes are spread over them: of two the first is along the normal.
    #[inline(always)]
    pub(crate) fn numbers(&self, words: UVec4, index: u32, per_segment: f32) -> DiskNumbers {
        let unit = rng::unit;
        // the words that are spread best make the point of the disk
        let axis = (index as f32 + unit(words.z)) * per_segment;
        let numbers = Vec4::new(axis, unit(words.w), unit(words.x), unit(words.y));
        DiskNumbers::new(numbers, &self.disk.profile)
    }

    /// What a point of the segment is worth: the profile over the density.
    #[inline(always)]
    pub(crate) fn worth(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let (weight, _) = self.disk.weight(position, normal);
        self.left(position, weight)
    }

    /// The profile at a point, per area there: the part of the light entering there that leaves here.
    #[inline(always)]
    pub(crate) fn at(&self, position: Vec3) -> Vec3 {
        self.left(position, self.disk.profile.at(length(position - self.disk.centre)))
    }

    /// What is left of the whole profile's value at a point.
    #[inline(always)]
    fn left(&self, position: Vec3, whole: Vec3) -> Vec3 {
        let x = self.extinction * length(position - self.disk.centre);
        let share = Vec3::new(self.rest[0].share(x.x), self.rest[1].share(x.y), self.rest[2].share(x.z));
        if self.whole { whole } else { whole * share }
    }
}
