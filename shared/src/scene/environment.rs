//! The environment: a latitude-longitude map, sampled by its luminance.
//!
//! The middle column lies at +z, a quarter of the width to its left at +x; rows run from +y down to -y. Radiance is
//! interpolated bilinearly; the density is constant in a pixel but for the sine of the polar angle, and positive
//! wherever the interpolated radiance is, because the host builds the table of 3 x 3 neighbourhoods.

use super::{AddressedLight, EnvironmentPoint, LightKind, LightSample, SceneView};
#[cfg(not(target_arch = "spirv"))]
use crate::lanes::Lanes;
use crate::num;
use crate::pack::xyz;
#[cfg(not(target_arch = "spirv"))]
use crate::sampling::find_discrete_each;
use crate::sampling::{TableSample, find_table_2d, table_2d_pdf, table_2d_probability, table_2d_sample};
use glam::{Vec2, Vec3};

/// Sines of polar angles below this count as this, so that the density is finite at the poles.
const MIN_SINE: f32 = 1.0e-6;
const TWO_PI_SQUARED: f32 = 19.739_21;
const INV_TWO_PI_SQUARED: f32 = 0.050_660_59;

/// The record of the environment.
struct Environment {
    /// First word of the pixels.
    base: u32,
    width: u32,
    height: u32,
    /// First word of the rows' distribution.
    rows: u32,
    /// Turn about +y, in turns.
    rotation: f32,
    /// Probability with which it is chosen among the lights.
    probability: f32,
}

impl<const COMPILED: u32> SceneView<'_, COMPILED> {
    #[inline(always)]
    fn environment_record(&self) -> Environment {
        let a = self.attribute(self.header.environment_base);
        let b = self.attribute(self.header.environment_base + 1);
        Environment {
            base: a.x,
            width: a.y,
            height: a.z,
            rows: a.w,
            rotation: f32::from_bits(b.x),
            probability: f32::from_bits(b.y),
        }
    }

    #[inline(always)]
    fn row_bound(&self, e: &Environment, row: u32) -> u32 {
        self.texel_word(e.rows + row).x
    }

    #[inline(always)]
    fn column_bound(&self, e: &Environment, row: u32, column: u32) -> u32 {
        self.texel_word(e.base + row * e.width + column).w
    }

    /// What arrives from a unit direction.
    #[inline(always)]
    pub(super) fn environment_point(&self, direction: Vec3) -> EnvironmentPoint {
        let (uv, sine) = self.map_point(direction);
        self.environment_at(&self.environment_record(), uv, sine)
    }

    /// The point of the map in a unit direction, and the sine of the polar angle.
    #[inline(always)]
    pub(super) fn map_point(&self, direction: Vec3) -> (Vec2, f32) {
        let sine = num::sqrt(direction.x * direction.x + direction.z * direction.z);
        let azimuth = num::atan2(direction.x, -direction.z) - self.environment_record().rotation;
        let u = azimuth - num::floor(azimuth);
        (Vec2::new(u, num::clamp(num::atan2(sine, direction.y) * 2.0, 0.0, 1.0)), sine)
    }

    /// Radiance and density at a point of the map; `sine` is that of the polar angle.
    #[inline(always)]
    fn environment_at(&self, e: &Environment, uv: Vec2, sine: f32) -> EnvironmentPoint {
        let at = Vec2::new(uv.x * e.width as f32, uv.y * e.height as f32);
        let column = (at.x as u32).min(e.width.wrapping_sub(1));
        let row = (at.y as u32).min(e.height.wrapping_sub(1));
        let probability = table_2d_probability(
            [column, row],
            e.width,
            e.height,
            |row| self.row_bound(e, row),
            |row, column| self.column_bound(e, row, column),
        );
        EnvironmentPoint { radiance: self.environment_radiance(e, at), density: density(e, probability, sine) }
    }

    /// Bilinear between pixel centres, around the seam, and constant beyond the first and the last row's.
    #[inline(always)]
    fn environment_radiance(&self, e: &Environment, at: Vec2) -> Vec3 {
        let (x, y) = (at.x - 0.5, at.y - 0.5);
        let (below_x, below_y) = (num::floor(x), num::floor(y));
        let (share_x, share_y) = (x - below_x, y - below_y);
        let (last_x, last_y) = (e.width.wrapping_sub(1), e.height.wrapping_sub(1));
        let left = if below_x < 0.0 { last_x } else { (below_x as u32).min(last_x) };
        let right = if left == last_x { 0 } else { left + 1 };
        let top = if below_y < 0.0 { 0 } else { (below_y as u32).min(last_y) };
        let bottom = if below_y < 0.0 { 0 } else { (top + 1).min(last_y) };
        let mut sum = Vec3::ZERO;
        let mut corner = 0;
        while corner < 4 {
            let (column, wx) = if corner & 1 == 0 { (left, 1.0 - share_x) } else { (right, share_x) };
            let (row, wy) = if corner & 2 == 0 { (top, 1.0 - share_y) } else { (bottom, share_y) };
            sum += xyz(self.texel_word(e.base + row * e.width + column)) * (wx * wy);
            corner += 1;
        }
        sum
    }

    /// The pixel of the map, [column, row], that two random words choose in proportion to luminance.
    #[inline(always)]
    pub(super) fn environment_cell(&self, words: [u32; 2]) -> [u32; 2] {
        let e = self.environment_record();
        find_table_2d(
            words,
            e.width,
            e.height,
            |row| self.row_bound(&e, row),
            |row, column| self.column_bound(&e, row, column),
        )
    }

    /// [`Self::environment_cell`] of two words in each lane, in step.
    #[cfg(not(target_arch = "spirv"))]
    #[inline(always)]
    pub(crate) fn environment_cells(&self, words: &[Lanes<u32>; 2]) -> [Lanes<u32>; 2] {
        let e = self.environment_record();
        let rows = find_discrete_each(&words[0], e.height, |_, row| self.row_bound(&e, row));
        let columns =
            find_discrete_each(&words[1], e.width, |lane, column| self.column_bound(&e, rows.get(lane), column));
        [columns, rows]
    }

    /// A direction in the pixel of the map that two random words have chosen.
    #[inline(always)]
    pub(super) fn sample_environment(&self, cell: [u32; 2], words: [u32; 2]) -> LightSample {
        let e = self.environment_record();
        let sample = self.sample_cell(&e, cell, words);
        let at = Vec2::new(sample.cell[0] as f32, sample.cell[1] as f32) + sample.fraction;
        let (direction, sine) = direction(&e, at);
        LightSample {
            position: direction,
            emission: self.environment_radiance(&e, at),
            density: density(&e, sample.probability, sine),
            kind: LightKind::Environment,
            ..LightSample::NONE
        }
    }

    #[inline(always)]
    fn sample_cell(&self, e: &Environment, cell: [u32; 2], words: [u32; 2]) -> TableSample {
        table_2d_sample(
            cell,
            words,
            e.width,
            e.height,
            |row| self.row_bound(e, row),
            |row, column| self.column_bound(e, row, column),
        )
    }

    /// A point of the map, as [`Self::sample_environment`] chooses it.
    #[inline(always)]
    pub(super) fn sample_map(&self, words: [u32; 2]) -> Vec2 {
        let e = self.environment_record();
        let sample = self.sample_cell(&e, self.environment_cell(words), words);
        Vec2::new(
            (sample.cell[0] as f32 + sample.fraction.x) * num::recip(e.width as f32),
            (sample.cell[1] as f32 + sample.fraction.y) * num::recip(e.height as f32),
        )
    }

    /// The environment at a point of the map.
    #[inline(always)]
    pub(super) fn environment_sample(&self, uv: Vec2) -> AddressedLight {
        let e = self.environment_record();
        let (direction, sine) = direction(&e, Vec2::new(uv.x * e.width as f32, uv.y * e.height as f32));
        let point = self.environment_at(&e, uv, sine);
        AddressedLight {
            sample: LightSample {
                position: direction,
                emission: point.radiance,
                density: point.density,
                kind: LightKind::Environment,
                ..LightSample::NONE
            },
            extent: TWO_PI_SQUARED * num::max(sine, MIN_SINE),
        }
    }
}

/// The direction of a point of the map, in pixels, and the sine of its polar angle.
#[inline(always)]
fn direction(e: &Environment, at: Vec2) -> (Vec3, f32) {
    let u = at.x * num::recip(e.width as f32) + e.rotation;
    let (sine, cosine) = num::sin_cos(at.y * num::recip(e.height as f32) * 0.5);
    let (sin_u, cos_u) = num::sin_cos(u);
    (Vec3::new(sine * sin_u, cosine, -sine * cos_u), sine)
}

/// Density per steradian in a pixel of the given probability: the map's area element is 2 pi^2 sin.
#[inline(always)]
fn density(e: &Environment, probability: f32, sine: f32) -> f32 {
    let per_area = table_2d_pdf(probability * e.probability, e.width, e.height) * INV_TWO_PI_SQUARED;
    num::div(per_area, num::max(sine, MIN_SINE))
}
