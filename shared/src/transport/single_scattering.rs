//! Light that collides once inside a medium, between where it enters and where it reaches the border again.

use crate::geometry::{Hit, Ray};
use crate::medium::{Channels, Medium, transmittance};
use crate::sampling::sample_henyey_greenstein;
use crate::scene::Trace;
use crate::vec::{Frame, flush};
use glam::{Vec2, Vec3};

/// How near a collision may come to a surface, as a fraction of the largest coordinate: as near as rays begin beside it.
pub(crate) const COLLISION_MARGIN: f32 = 1.0 / 262_144.0;
/// Cosines below this count as it, where a distance is divided by them.
pub(crate) const GRAZING_COSINE: f32 = 1.0 / 4096.0;

/// How light goes from its collision to the border.
///
/// Both are unbiased (Zhang and d'Eon 2025, whose slide divides [`Self::Drawn`] by the density of its length, not by the
/// probability of getting so far, and whose mean is infinite).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum WayOut {
    /// All the way, dimmed by what the medium takes.
    #[default]
    Dimmed,
    /// As far as it would go to its next collision. Rays are short, and the variance is larger: what does not reach the border is lost.
    Drawn,
}

/// A collision of light that has entered, and how it goes on.
#[derive(Clone, Copy, Debug)]
pub struct Collision {
    /// How far from where it entered.
    pub t: f32,
    /// The unit direction after it, sampled by the phase function.
    pub direction: Vec3,
    /// How far the ray goes from there that looks for the border.
    pub reach: f32,
    worth: Vec3,
    channels: Channels,
    extinction: Vec3,
    drawn: bool,
}

impl Collision {
    /// No collision.
    pub const NONE: Self = Self {
        t: 0.0,
        direction: Vec3::Z,
        reach: 0.0,
        worth: Vec3::ZERO,
        channels: Channels::NONE,
        extinction: Vec3::ZERO,
        drawn: false,
    };

    /// Of light that entered in `direction`, of unit length, and would reach the border after `length`. The numbers, in [0, 1), choose a
    /// channel and a distance below `length`, a direction, and again a channel and a distance, which [`WayOut::Dimmed`] does not need.
    #[inline(always)]
    pub fn sample(medium: &Medium, direction: Vec3, length: f32, u: [Vec2; 3], way: WayOut) -> Self {
        let channels = Channels::new(medium.extinction, medium.extinction * medium.albedo);
        let t = channels.sample_within(u[0], length);
        let turned = sample_henyey_greenstein(u[1], medium.anisotropy);
        let drawn = way == WayOut::Drawn;
        Self {
            t,
            direction: Frame::new(direction).to_world(turned),
            reach: if drawn { channels.sample(u[2]) } else { Ray::FAR },
            worth: medium.albedo * channels.collided_within(t, length),
            channels,
            extinction: medium.extinction,
            drawn,
        }
    }

    /// What the light is worth that reaches the border after a further distance of `t`, below [`Self::reach`], of light that entered with a
    /// worth of 1: it has passed [`transmittance`] and the collision.
    #[inline(always)]
    pub fn worth_after(&self, t: f32) -> Vec3 {
        self.worth_of(t, transmittance(self.extinction, t))
    }

    /// As [`Self::worth_after`], of which the transmittance is known.
    #[inline(always)]
    pub fn worth_of(&self, t: f32, transmittance: Vec3) -> Vec3 {
        self.worth * if self.drawn { self.channels.passed(t) } else { flush(transmittance) }
    }
}

/// Light that has collided once.
#[derive(Debug)]
pub struct ScatteredOnce {
    /// From the collision on, in a direction of unit length.
    pub ray: Ray,
    /// Where that reaches a border; a miss, if it does not.
    pub hit: Hit,
    /// What it is worth there ([`Collision::worth_after`]).
    pub worth: Vec3,
}

/// Scatters once what enters along `entry`, whose direction has unit length, and whose `t_max` is the distance to the border ahead, by
/// the numbers of [`Collision::sample`].
///
/// `entry` begins at the border itself: where a ray had to begin further inside, the distance of its hit lacks that much, which in dense
/// media is a good part of a mean free path. Nothing inside blocks but what `scene` hits.
#[inline(always)]
pub fn scatter_once<S: Trace>(scene: &S, entry: &Ray, medium: &Medium, u: [Vec2; 3], way: WayOut) -> ScatteredOnce {
    let collision = Collision::sample(medium, entry.direction, entry.t_max, u, way);
    let ray = Ray {
        origin: entry.origin + entry.direction * collision.t,
        direction: collision.direction,
        t_max: collision.reach,
        key: entry.key,
    };
    let hit = scene.closest(&ray);
    let worth = if hit.is_hit() { collision.worth_after(hit.t) } else { Vec3::ZERO };
    ScatteredOnce { ray, hit, worth }
}
