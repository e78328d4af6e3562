//! Light that collides once inside a medium, between where it enters and where it reaches the border again.

use crate::geometry::{Hit, Ray};
use crate::medium::{Channels, Medium, transmittance};
use crate::sampling::sample_henyey_greenstein;
use crate::scene::Trace;
use crate::vec::{Frame, flush};
use glam::{Vec2, Vec3};

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

/// Light that has collided once.
pub struct ScatteredOnce {
    /// From the collision on, in a direction of unit length.
    pub ray: Ray,
    /// Where that reaches a border; a miss, if it does not.
    pub hit: Hit,
    /// What it is worth there, of light that entered with a worth of 1. It has passed [`transmittance`] and the collision; the
    /// direction is sampled by the phase function, whose density it has.
    pub worth: Vec3,
}

/// Scatters once what enters along `entry`, whose direction has unit length, and whose `t_max` is the distance to the border ahead.
///
/// `entry` begins at the border itself: where a ray had to begin further inside, the distance of its hit lacks that much, which in dense
/// media is a good part of a mean free path. The numbers, in [0, 1), choose a channel and a distance, a direction, and again a channel and a
/// distance, which [`WayOut::Dimmed`] does not need. The distance before the collision is never beyond the border. Nothing inside
/// blocks but what `scene` hits.
#[inline(always)]
pub fn scatter_once<S: Trace>(scene: &S, entry: &Ray, medium: &Medium, u: [Vec2; 3], way: WayOut) -> ScatteredOnce {
    let channels = Channels::new(medium.extinction, medium.extinction * medium.albedo);
    let t = channels.sample_within(u[0], entry.t_max);
    let turned = sample_henyey_greenstein(u[1], medium.anisotropy);
    let drawn = way == WayOut::Drawn;
    let ray = Ray {
        origin: entry.origin + entry.direction * t,
        direction: Frame::new(entry.direction).to_world(turned),
        t_max: if drawn { channels.sample(u[2]) } else { Ray::FAR },
        key: entry.key,
    };
    let hit = scene.closest(&ray);
    let mut worth = Vec3::ZERO;
    if hit.is_hit() {
        let left = if drawn { channels.passed(hit.t) } else { flush(transmittance(medium.extinction, hit.t)) };
        worth = medium.albedo * channels.collided_within(t, entry.t_max) * left;
    }
    ScatteredOnce { ray, hit, worth }
}
