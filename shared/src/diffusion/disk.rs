//! Points of a surface around one of its points, by disks along three axes (King et al. 2013, "BSSRDF Importance Sampling").

use super::profile::Channels;
use super::{Profile, REACH, TAIL, invert_radius, sample_radius};
use crate::geometry::Ray;
use crate::num::{UNIT_ROUNDOFF, abs, atan2, div, max, min, sin_cos, sqrt};
use crate::vec::{Frame, flush, length};
use glam::{Vec3, Vec4};

/// Probabilities of the axes: the normal, and each of the two tangents.
const AXES: [f32; 2] = [0.5, 0.25];
const DENSITY_SCALE: f32 = 1.0 / (1.0 - TAIL);

/// Which axes and channels count as able to find a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum Support {
    /// A channel counts that can find the point: its segments end at the sphere of its reach, so it finds what lies in that sphere, by any axis.
    #[default]
    Exact,
    /// All axes and channels count, as published programs have it. What a narrow channel cannot find is then divided by its density all the same, and lost:
    /// a tenth of the light through a slab four `d` thick.
    Published,
}

/// What makes a segment: random numbers, of which the first two have chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiskNumbers {
    /// 0 is the normal, 1 and 2 are the tangents.
    pub axis: u32,
    /// Colour channel, 0 to 2, of whose profile the radius is drawn.
    pub channel: u32,
    /// [`sample_radius`] makes a radius of it.
    pub radius: f32,
    /// The angle, in turns.
    pub turn: f32,
}

/// Samples of the points around one.
#[derive(Clone, Copy, Debug)]
pub struct Disk {
    /// World position of the point where light enters or leaves, around which the disk lies.
    pub centre: Vec3,
    /// About its geometric normal.
    pub frame: Frame,
    /// How far light goes.
    pub profile: Profile,
    /// Which densities count.
    pub support: Support,
}

impl DiskNumbers {
    /// Of no segment in particular.
    pub(crate) const NONE: Self = Self { axis: 0, channel: 0, radius: 0.0, turn: 0.0 };

    /// Chooses axis and channel by the first two of four numbers in [0, 1); the other two are kept.
    #[inline(always)]
    pub fn new(u: Vec4, profile: &Profile) -> Self {
        let axis = if u.x < AXES[0] {
            0
        } else if u.x < AXES[0] + AXES[1] {
            1
        } else {
            2
        };
        let Vec3 { x, y, z } = profile.probability;
        // rounding may leave a remainder to a channel that is never chosen
        let channel = if u.y < x || (y <= 0.0) & (z <= 0.0) {
            0
        } else if u.y < x + y || z <= 0.0 {
            1
        } else {
            2
        };
        Self { axis, channel, radius: u.z, turn: u.w }
    }
}

impl Disk {
    /// With the exact support.
    #[inline(always)]
    pub fn new(centre: Vec3, normal: Vec3, profile: Profile) -> Self {
        Self { centre, frame: Frame::new(normal), profile, support: Support::Exact }
    }

    /// The segment on which points are looked for: a chord of the sphere of the channel's reach. Its direction has unit length, its key
    /// is 0.
    #[inline(always)]
    pub fn segment(&self, numbers: &DiskNumbers) -> Ray {
        let distance = component(self.profile.distance, numbers.channel);
        let (r, reach) = (sample_radius(numbers.radius) * distance, REACH * distance);
        let half = sqrt(max((reach - r) * (reach + r), 0.0));
        let (sin, cos) = sin_cos(numbers.turn);
        let beside = self.frame.to_world(unfolded(numbers.axis, Vec3::new(r * cos, r * sin, half)));
        let axis = axis_of(&self.frame, numbers.axis);
        Ray { origin: self.centre + beside, direction: -axis, t_max: 2.0 * half, key: 0 }
    }

    /// The density per area of a point with the unit geometric normal `normal`, of a segment all of whose hits are taken: each point that
    /// a segment meets is a sample. Where one of n hits is taken, it is an n-th of it.
    #[inline(always)]
    pub fn density(&self, point: Vec3, normal: Vec3) -> f32 {
        Around::new(self, point, normal).densities()
    }

    /// With which probability a segment has the channel of these numbers. Where it is another one at another point, so is the share of the channel's
    /// segments in a point's density.
    #[inline(always)]
    pub(crate) fn probability(&self, numbers: &DiskNumbers) -> f32 {
        component(self.profile.probability, numbers.channel)
    }

    /// What a point is worth as a sample: the profile there over the density, by channel, and the density. At most 4 over the
    /// probability of the channel, because a profile falls with the distance, which a disk sees shortened, and the axes' cosines with
    /// the normal add up to one or more.
    #[inline(always)]
    pub fn weight(&self, point: Vec3, normal: Vec3) -> (Vec3, f32) {
        let density = self.density(point, normal);
        let per_density = if density > 0.0 { div(1.0, density) } else { 0.0 };
        (self.profile.at(length(point - self.centre)) * per_density, density)
    }

    /// Numbers that find the point, of all that do: axis and channel are drawn by `u` in [0, 1) in proportion to their shares in the
    /// density, which is given, too; if that is zero, no numbers do.
    #[inline(always)]
    pub fn invert(&self, point: Vec3, normal: Vec3, u: f32) -> (DiskNumbers, f32) {
        let around = Around::new(self, point, normal);
        let all = around.densities();
        let (mut found, mut left) = ([0, 0], u * all);
        let mut axis = 0;
        while axis < 3 {
            let shares = around.density(axis);
            let mut channel = 0;
            while channel < 3 {
                let share = component(shares, channel);
                // the last one with a share stands for what rounding leaves
                found = if (share > 0.0) & (left >= 0.0) { [axis, channel] } else { found };
                left -= share;
                channel += 1;
            }
            axis += 1;
        }
        let [axis, channel] = found;
        let beside = folded(axis, around.beside);
        let distance = component(self.profile.distance, channel);
        let radius = plane_length(beside);
        let turn = atan2(beside.y, beside.x);
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        let x = if all > 0.0 { div(radius, distance) } else { 0.0 };
        let radius = invert_radius(x);
        (DiskNumbers { axis, channel, radius, turn: min(turn, 1.0 - UNIT_ROUNDOFF) }, all)
    }
}

/// A point as a disk sees it.
struct Around {
    /// Where it lies from the centre, in the disk's frame.
    beside: Vec3,
    /// The point's normal in the same frame.
    cosines: Vec3,
    channels: Channels,
    /// Of the channels that can find it the probabilities.
    scale: Vec3,
}

impl Around {
    #[inline(always)]
    fn new(disk: &Disk, point: Vec3, normal: Vec3) -> Self {
        let beside = disk.frame.to_local(point - disk.centre);
        let profile = &disk.profile;
        let scale = if disk.support == Support::Exact {
            profile.within(length(beside), profile.probability)
        } else {
            profile.probability
        };
        Self { beside, cosines: disk.frame.to_local(normal), channels: Channels::new(profile), scale }
    }

    /// The sum over axes and channels.
    #[inline(always)]
    fn densities(&self) -> f32 {
        let (mut all, mut axis) = (0.0, 0);
        while axis < 3 {
            all += sum(self.density(axis));
            axis += 1;
        }
        all
    }

    /// The densities of an axis by channel, each times its probability. They are flushed, since a subnormal one has no finite inverse.
    #[inline(always)]
    fn density(&self, axis: u32) -> Vec3 {
        let radius = plane_length(folded(axis, self.beside));
        let cosine = abs(folded(axis, self.cosines).z);
        let probability = if axis == 0 { AXES[0] } else { AXES[1] };
        flush(self.channels.at(radius) * self.scale * (DENSITY_SCALE * probability * cosine))
    }
}

#[inline(always)]
fn sum(v: Vec3) -> f32 {
    v.x + v.y + v.z
}

#[inline(always)]
fn component(v: Vec3, index: u32) -> f32 {
    if index == 0 {
        v.x
    } else if index == 1 {
        v.y
    } else {
        v.z
    }
}

/// Coordinates in a frame, those in the plane of an axis' disk first.
#[inline(always)]
fn folded(axis: u32, v: Vec3) -> Vec3 {
    if axis == 0 {
        v
    } else if axis == 1 {
        Vec3::new(v.y, v.z, v.x)
    } else {
        Vec3::new(v.z, v.x, v.y)
    }
}

/// The inverse of [`folded`].
#[inline(always)]
fn unfolded(axis: u32, v: Vec3) -> Vec3 {
    if axis == 0 {
        v
    } else if axis == 1 {
        Vec3::new(v.z, v.x, v.y)
    } else {
        Vec3::new(v.y, v.z, v.x)
    }
}

#[inline(always)]
fn axis_of(frame: &Frame, axis: u32) -> Vec3 {
    if axis == 0 {
        frame.n
    } else if axis == 1 {
        frame.s
    } else {
        frame.t
    }
}

/// The distance from the axis, by the coordinates across it.
#[inline(always)]
fn plane_length(v: Vec3) -> f32 {
    sqrt(v.x * v.x + v.y * v.y)
}
