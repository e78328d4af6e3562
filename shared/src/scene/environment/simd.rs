//! The environment in lanes.
//!
//! What is read of the map are whole words, lane by lane, and what is computed of them is computed by SIMD: to gather the components of
//! words takes a processor longer than all of the arithmetic.

use super::{Around, Environment, EnvironmentPoint, LightSample, SceneView, light_sample};
use crate::lanes::{LANES, Lanes, soa};
use crate::layout::{ENVIRONMENT_PART, FEATURE_ENVIRONMENT, NONE};
use crate::pack::xyz;
use crate::sampling::find_discrete_each;
use glam::{UVec4, Vec2, Vec3};

soa! {
    EnvironmentPoints = EnvironmentPoint { radiance: Vec3, density: f32 }
}

impl<const COMPILED: u32> SceneView<'_, COMPILED> {
    /// [`Lights::environment`](crate::scene::Lights::environment) in each lane; without `DENSITY` densities are zero.
    #[inline(always)]
    pub(crate) fn environment_points<const DENSITY: bool>(&self, directions: &Lanes<Vec3>) -> Lanes<EnvironmentPoint> {
        let mut points = Lanes::ZERO;
        if !self.has(FEATURE_ENVIRONMENT) || self.header.environment_base == NONE {
            return points;
        }
        let e = self.environment_record();
        let (mut at, mut sines) = (Lanes::<Vec2>::ZERO, Lanes::<f32>::ZERO);
        for lane in 0..LANES {
            let (uv, sine) = self.map_point(directions.get(lane));
            at.set(lane, e.at(uv));
            sines.set(lane, sine);
        }
        let radiances = self.environment_radiances(&e, &at);
        for lane in 0..LANES {
            let density = if DENSITY { self.environment_density(&e, at.get(lane), sines.get(lane)) } else { 0.0 };
            points.set(lane, EnvironmentPoint { radiance: radiances.get(lane), density });
        }
        points
    }

    /// [`Self::sample_environment`] of two words in each lane.
    #[inline(always)]
    pub(crate) fn sample_environment_each(&self, words: &[Lanes<u32>; 2]) -> Lanes<LightSample> {
        let e = self.environment_record();
        let rows = find_discrete_each(
            &words[0],
            e.height,
            ENVIRONMENT_PART,
            |_| self.parts(&e, 0, parts_of(e.height)),
            |_, row| self.row_bound(&e, row),
        );
        let columns = find_discrete_each(
            &words[1],
            e.width,
            ENVIRONMENT_PART,
            |lane| self.parts(&e, parts_of(e.height) + rows.get(lane) * parts_of(e.width), parts_of(e.width)),
            |lane, column| self.column_bound(&e, rows.get(lane), column),
        );
        let (mut at, mut probabilities) = (Lanes::<Vec2>::ZERO, Lanes::<f32>::ZERO);
        for lane in 0..LANES {
            let cell = [columns.get(lane), rows.get(lane)];
            let (place, probability) = self.place_in_cell(&e, cell, [words[0].get(lane), words[1].get(lane)]);
            at.set(lane, place);
            probabilities.set(lane, probability);
        }
        let radiances = self.environment_radiances(&e, &at);
        let mut samples = Lanes::ZERO;
        for lane in 0..LANES {
            samples.set(lane, light_sample(&e, at.get(lane), probabilities.get(lane), radiances.get(lane)));
        }
        samples
    }

    /// Bounds of the first rows or columns of parts.
    #[inline(always)]
    fn parts(&self, e: &Environment, first: u32, count: u32) -> &[u32] {
        let words = bytemuck::cast_slice::<UVec4, u32>(self.texels);
        let first = (e.rows + e.height) as usize * 4 + first as usize;
        words.get(first..first + count as usize).unwrap_or_default()
    }

    /// Radiance at points of the map, in pixels.
    #[allow(clippy::needless_range_loop, reason = "with iterators the stages take 1.6 times as long")]
    #[inline(always)]
    fn environment_radiances(&self, e: &Environment, at: &Lanes<Vec2>) -> Lanes<Vec3> {
        let (mut words, mut weights) = ([Lanes::<u32>::ZERO; 4], [Lanes::<f32>::ZERO; 4]);
        for lane in 0..LANES {
            let around = Around::new(e, at.get(lane));
            for corner in 0..4 {
                let (word, weight) = around.corner(e, corner);
                words[corner as usize].set(lane, word);
                weights[corner as usize].set(lane, weight);
            }
        }
        let mut texels = [[UVec4::ZERO; 4]; LANES];
        for lane in 0..LANES {
            for corner in 0..4 {
                texels[lane][corner] = self.texel_word(words[corner].get(lane));
            }
        }
        let mut radiances = Lanes::ZERO;
        for lane in 0..LANES {
            let mut sum = Vec3::ZERO;
            for corner in 0..4 {
                sum += xyz(texels[lane][corner]) * weights[corner].get(lane);
            }
            radiances.set(lane, sum);
        }
        radiances
    }
}

/// Parts of so many rows or columns.
#[inline(always)]
fn parts_of(side: u32) -> u32 {
    side.div_ceil(ENVIRONMENT_PART)
}
