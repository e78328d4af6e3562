//! The environment: a latitude-longitude map, sampled by its luminance.
//!
//! The middle column lies at +z, a quarter of the width to its left at +x; rows run from +y down to -y. Radiance is
//! interpolated bilinearly; the density is constant in a pixel but for the sine of the polar angle, and positive
//! wherever the interpolated radiance is, because the host builds the table of 3 x 3 neighbourhoods.

#[cfg(not(target_arch = "spirv"))]
mod simd;

use super::{AddressedLight, EnvironmentPoint, LightKind, LightSample, SceneView};
use crate::num;
use crate::pack::xyz;
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

impl Environment {
    /// A point of the unit square in pixels.
    #[inline(always)]
    fn at(&self, uv: Vec2) -> Vec2 {
        Vec2::new(uv.x * self.width as f32, uv.y * self.height as f32)
    }
}

impl<const COMPILED: u32> SceneView<'_, COMPILED> {
    #[inline(always)]
    fn environment_record(&self) -> Environment {
        let a = self.attribute(self.header.environment_base);
        let b = self.attribute(self.header.environment_base.wrapping_add(1));
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
        let at = e.at(uv);
        EnvironmentPoint { radiance: self.environment_radiance(e, at), density: self.environment_density(e, at, sine) }
    }

    /// Density per steradian at a point of the map, in pixels.
    #[inline(always)]
    fn environment_density(&self, e: &Environment, at: Vec2, sine: f32) -> f32 {
        let column = (at.x as u32).min(e.width.wrapping_sub(1));
        let row = (at.y as u32).min(e.height.wrapping_sub(1));
        let probability = table_2d_probability(
            [column, row],
            e.width,
            e.height,
            |row| self.row_bound(e, row),
            |row, column| self.column_bound(e, row, column),
        );
        density(e, probability, sine)
    }

    /// Bilinear between pixel centres, around the seam, and constant beyond the first and the last row's.
    #[inline(always)]
    fn environment_radiance(&self, e: &Environment, at: Vec2) -> Vec3 {
        let around = Around::new(e, at);
        let mut sum = Vec3::ZERO;
        let mut corner = 0;
        while corner < 4 {
            let (word, weight) = around.corner(e, corner);
            sum += xyz(self.texel_word(word)) * weight;
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

    /// A direction in the pixel of the map that two random words choose.
    #[inline(always)]
    pub(super) fn sample_environment(&self, words: [u32; 2]) -> LightSample {
        let e = self.environment_record();
        let (at, probability) = self.place_in_cell(&e, self.environment_cell(words), words);
        light_sample(&e, at, probability, self.environment_radiance(&e, at))
    }

    /// The point of the map that two random words choose in the pixel that they choose, and the probability of that.
    #[inline(always)]
    fn place_in_cell(&self, e: &Environment, cell: [u32; 2], words: [u32; 2]) -> (Vec2, f32) {
        let sample = self.sample_cell(e, cell, words);
        (Vec2::new(sample.cell[0] as f32, sample.cell[1] as f32) + sample.fraction, sample.probability)
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
        let (direction, sine) = direction(&e, e.at(uv));
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

/// The pixels of the map around a point.
struct Around {
    left: u32,
    right: u32,
    top: u32,
    bottom: u32,
    /// How far the point is on the way from left to right.
    share_x: f32,
    /// How far it is on the way from top to bottom.
    share_y: f32,
}

impl Around {
    #[inline(always)]
    fn new(e: &Environment, at: Vec2) -> Self {
        let (x, y) = (at.x - 0.5, at.y - 0.5);
        let (below_x, below_y) = (num::floor(x), num::floor(y));
        let (share_x, share_y) = (x - below_x, y - below_y);
        let (last_x, last_y) = (e.width.wrapping_sub(1), e.height.wrapping_sub(1));
        let left = if below_x < 0.0 { last_x } else { (below_x as u32).min(last_x) };
        let right = if left == last_x { 0 } else { left + 1 };
        let top = if below_y < 0.0 { 0 } else { (below_y as u32).min(last_y) };
        let bottom = if below_y < 0.0 { 0 } else { (top + 1).min(last_y) };
        Self { left, right, top, bottom, share_x, share_y }
    }

    /// The word of a corner, of 0 to 3, and what it counts.
    #[inline(always)]
    fn corner(&self, e: &Environment, corner: u32) -> (u32, f32) {
        let (column, wx) = if corner & 1 == 0 { (self.left, 1.0 - self.share_x) } else { (self.right, self.share_x) };
        let (row, wy) = if corner & 2 == 0 { (self.top, 1.0 - self.share_y) } else { (self.bottom, self.share_y) };
        (e.base + row * e.width + column, wx * wy)
    }
}

/// The light sample of a point of the map that was chosen with a pixel of the given probability.
#[inline(always)]
fn light_sample(e: &Environment, at: Vec2, probability: f32, radiance: Vec3) -> LightSample {
    let (direction, sine) = direction(e, at);
    LightSample {
        position: direction,
        emission: radiance,
        density: density(e, probability, sine),
        kind: LightKind::Environment,
        ..LightSample::NONE
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
