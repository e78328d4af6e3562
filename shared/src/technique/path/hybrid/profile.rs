//! What a profile is where a path enters a body.

use super::params::Fit;
use super::record::Entry;
use crate::diffusion::{Depth, Disk, DiskNumbers, Multiple, Profile, Thickness};
use crate::medium::{Interior, Medium};
use crate::num::max;
use crate::rng;
use crate::scene::{Location, Surface};
use crate::technique::path::PathFlags;
use crate::vec::length;
use glam::{UVec4, Vec3, Vec4};

/// The profile around an entry, less what has scattered once, if that is found elsewhere.
#[derive(Clone, Copy)]
pub(crate) struct EntryProfile {
    /// By which its points are found.
    pub(crate) disk: Disk,
    rest: [Multiple; 3],
    thickness: [Thickness; 3],
    extinction: Vec3,
    /// 1 of the channels that are Lambertian.
    narrow: Vec3,
    /// Reflectance of the channels that are Lambertian.
    pub(crate) lambert: Vec3,
    whole: bool,
    /// Whether it depends on how thick the body is.
    by_thickness: bool,
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
        let thickness = |absorbed: f32| Thickness::new(absorbed, anisotropy);
        Self {
            disk,
            rest: [rest(albedo.x, absorbed.x), rest(albedo.y, absorbed.y), rest(albedo.z, absorbed.z)],
            thickness: [thickness(absorbed.x), thickness(absorbed.y), thickness(absorbed.z)],
            extinction,
            narrow: Vec3::ONE - kept,
            lambert: medium.color() * (Vec3::ONE - kept),
            whole: fit.has(PathFlags::WHOLE),
            by_thickness: fit.has(PathFlags::THICKNESS),
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
    pub(crate) fn worth(&self, point: &Location) -> Vec3 {
        let (weight, _) = self.disk.weight(point.position, point.normal);
        self.left(point, weight)
    }

    /// The profile at a point, per area there: the part of the light entering there that leaves here.
    #[inline(always)]
    pub(crate) fn at(&self, point: &Location) -> Vec3 {
        self.left(point, self.disk.profile.at(length(point.position - self.disk.centre)))
    }

    /// By what all of it is multiplied because the body ends, by channel: 1 of Lambertian channels.
    #[inline(always)]
    pub(crate) fn kept<S: Surface>(&self, scene: &S, entry: &Entry, (at, body): (&Location, u32)) -> Vec3 {
        if !self.by_thickness {
            return Vec3::ONE;
        }
        let x = self.extinction * entry.thickness(scene, at, body);
        let [red, green, blue] = self.thickness;
        let of = |channel: Thickness, x: f32, narrow: f32| max(channel.kept(x), narrow);
        Vec3::new(of(red, x.x, self.narrow.x), of(green, x.y, self.narrow.y), of(blue, x.z, self.narrow.z))
    }

    /// What is left of the whole profile's value at a point.
    #[inline(always)]
    fn left(&self, point: &Location, whole: Vec3) -> Vec3 {
        let way = point.position - self.disk.centre;
        let paths = self.extinction * length(way);
        let share = Vec3::new(self.rest[0].share(paths.x), self.rest[1].share(paths.y), self.rest[2].share(paths.z));
        let (depth, Vec3 { x, y, z }) = (Depth::new(way, self.disk.frame.n, point.normal), self.extinction);
        let [red, green, blue] = self.thickness;
        let gain = Vec3::new(red.gain(&depth, x), green.gain(&depth, y), blue.gain(&depth, z));
        let share = if self.by_thickness { share * gain } else { share };
        if self.whole { whole } else { whole * share }
    }
}
