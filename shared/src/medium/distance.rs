//! How far light goes, where the channels of its colour have coefficients of their own.

use crate::num::{div, exp, expm1, flush, max, min};
use crate::sampling::{sample_bounded_exponential, sample_exponential};
use glam::{Vec2, Vec3};

/// Where nothing collides: farther than any scene.
const FAR: f32 = 1.0e30;
const THIRD: f32 = 1.0 / 3.0;
/// Optical depth below which `1 - exp(-x)` is a parabola, to less than a rounding.
const THIN: f32 = 1.0 / 2048.0;
/// Channels are chosen as if at least so much was scattered of a collision: one that scatters nothing still passes what does not collide, and where
/// light goes farther in it than in those that are chosen, its weight would grow exponentially.
const LEAST_SCATTERED: f32 = 1.0 / 1024.0;

/// The share of light that is left after a distance `t`, by channel (Beer and Lambert).
#[inline(always)]
pub fn transmittance(extinction: Vec3, t: f32) -> Vec3 {
    Vec3::new(exp(-(extinction.x * t)), exp(-(extinction.y * t)), exp(-(extinction.z * t)))
}

/// The channels by which a distance is sampled: one of them is chosen, and the distance has its density. What is sampled is weighted by
/// the density of the mixture, the sum of all channels' densities times the probabilities of their choice, so that no channel has weights
/// beyond its share (the "one-sample" balance heuristic of Veach 1997, section 9.2.4; with a single channel, the weights are 1).
#[derive(Clone, Copy, Debug)]
pub struct Channels {
    extinction: Vec3,
    probability: Vec3,
    /// The smallest extinction of a channel that may be chosen: exponents are relative to it, so that what is far away is divided by
    /// no zero.
    least: f32,
}

impl Channels {
    /// The channels in a vacuum, which has no collisions.
    pub const NONE: Self = Self { extinction: Vec3::ZERO, probability: Vec3::splat(THIRD), least: 0.0 };

    /// Each channel is chosen in proportion to its weight, zero or more; all alike, if none has any. The best weights are what paths are
    /// worth after the next collision: throughput times albedo.
    #[inline(always)]
    pub fn new(extinction: Vec3, weights: Vec3) -> Self {
        let sum = flush(weights.x + weights.y + weights.z);
        let probability = if sum > 0.0 { weights * div(1.0, sum) } else { Vec3::splat(THIRD) };
        let of_chosen = |extinction: f32, probability: f32| if probability > 0.0 { extinction } else { FAR };
        let least = min(
            of_chosen(extinction.x, probability.x),
            min(of_chosen(extinction.y, probability.y), of_chosen(extinction.z, probability.z)),
        );
        Self { extinction, probability, least }
    }

    /// For a path of some throughput, which is scattered by `albedo` where it collides. No channel's light grows by one step beyond 1024 times the sum
    /// of all, nor beyond that sum over its albedo.
    #[inline(always)]
    pub fn of_path(extinction: Vec3, throughput: Vec3, albedo: Vec3) -> Self {
        let floor = |albedo: f32| max(albedo, LEAST_SCATTERED);
        Self::new(extinction, throughput * Vec3::new(floor(albedo.x), floor(albedo.y), floor(albedo.z)))
    }

    #[inline(always)]
    fn chosen(&self, u: f32) -> f32 {
        let Vec3 { x, y, z } = self.probability;
        // rounding may leave a remainder to a channel that is never chosen
        if u < x || (y <= 0.0) & (z <= 0.0) {
            self.extinction.x
        } else if u < x + y || z <= 0.0 {
            self.extinction.y
        } else {
            self.extinction.z
        }
    }

    /// A distance; the first number chooses the channel. It is very large where there is nothing to collide with.
    #[inline(always)]
    pub fn sample(&self, u: Vec2) -> f32 {
        let rate = self.chosen(u.x);
        if rate > 0.0 { min(sample_exponential(u.y, rate), FAR) } else { FAR }
    }

    /// What a collision at a distance that [`Self::sample`] gave is worth, before it is scattered: extinction times what is left, over the
    /// density of the distance.
    #[inline(always)]
    pub fn collided(&self, t: f32) -> Vec3 {
        self.worth(t, true)
    }

    /// What passing a distance is worth, where [`Self::sample`] gave a larger one: what is left, over its probability.
    #[inline(always)]
    pub fn passed(&self, t: f32) -> Vec3 {
        self.worth(t, false)
    }

    /// [`Self::collided`] or [`Self::passed`].
    #[inline(always)]
    pub fn worth(&self, t: f32, collides: bool) -> Vec3 {
        let left = self.left(t);
        let light = if collides { self.extinction * left } else { left };
        light * div(1.0, self.mixture(light))
    }

    /// A distance below `t_max` > 0, at which light collides for certain.
    #[inline(always)]
    pub fn sample_within(&self, u: Vec2, t_max: f32) -> f32 {
        sample_bounded_exponential(u.y, self.chosen(u.x), t_max)
    }

    /// As [`Self::collided`], at a distance that [`Self::sample_within`] gave.
    #[inline(always)]
    pub fn collided_within(&self, t: f32, t_max: f32) -> Vec3 {
        let left = self.left(t);
        let rate = Vec3::new(
            bounded_rate(self.extinction.x, t_max),
            bounded_rate(self.extinction.y, t_max),
            bounded_rate(self.extinction.z, t_max),
        );
        // in this order, for what is left of a channel that is never chosen may be as large as numbers are
        let Vec3 { x, y, z } = self.probability * left;
        self.extinction * left * div(1.0, x * rate.x + y * rate.y + z * rate.z)
    }

    /// What is left of light after a distance, over what is left of the channel that is absorbed least.
    #[inline(always)]
    fn left(&self, t: f32) -> Vec3 {
        let of = |extinction: f32| exp(-((extinction - self.least) * t));
        Vec3::new(of(self.extinction.x), of(self.extinction.y), of(self.extinction.z))
    }

    #[inline(always)]
    fn mixture(&self, v: Vec3) -> f32 {
        self.probability.x * v.x + self.probability.y * v.y + self.probability.z * v.z
    }
}

/// `rate / (1 - exp(-rate t_max))`, and its limit `1 / t_max`.
#[inline(always)]
fn bounded_rate(rate: f32, t_max: f32) -> f32 {
    let depth = rate * t_max;
    if depth < THIN { div(1.0 + 0.5 * depth, t_max) } else { div(rate, -expm1(-depth)) }
}
