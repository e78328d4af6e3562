//! The environment's pixels and the distribution of its directions.

use super::color::luminance;
use crate::{distribution::integer_cdf, scene::Environment};
use restir_shared::num::flush;
use std::f64::consts::PI;

/// A map is refined by this factor along both sides. It is odd, so that the middles of the given pixels are middles of finer ones,
/// and interpolation between these is that between the given ones.
const FINER: usize = 3;
/// The most pixels that refining may make. Of larger maps, what is small in the sky has many pixels anyway.
const MOST_REFINED: usize = 1 << 21;

/// The share of what arrives from everywhere alike that light samples leave to scattering, which finds it as well (Karlik et al. 2019,
/// "MIS Compensation", leave all of it). It is below 1 because light samples are also taken where scattering finds nothing.
const LEFT_TO_SCATTERING: f64 = 0.8;

/// The environment as [`restir_shared::layout`] has it.
#[derive(Debug)]
pub(super) struct EnvironmentMap {
    pub(super) size: [u32; 2],
    /// Scaled radiance, rows from the top, and the lower bound of the column's share of its row.
    pub(super) pixels: Vec<([f32; 3], u32)>,
    /// Lower bounds of the rows' shares.
    pub(super) rows: Vec<u32>,
    /// In turns.
    pub(super) rotation: f32,
    /// Of the luminance that light samples are to find, over all directions.
    pub(super) integral: f64,
}

/// Radiance, rows from the top.
struct Map {
    width: usize,
    height: usize,
    radiance: Vec<[f32; 3]>,
}

impl EnvironmentMap {
    /// `None` if it is black.
    pub(super) fn new(environment: &Environment) -> Option<Self> {
        let [width, height] = environment.size.map(|side| side as usize);
        let scaled = |rgb: &[f32; 3]| rgb.map(|x| flush(x * environment.scale));
        let given = Map { width, height, radiance: environment.pixels.iter().map(scaled).collect() };
        let map = if width * height * FINER * FINER <= MOST_REFINED { given.refined() } else { given };
        let luminances: Vec<f64> = map.radiance.iter().copied().map(luminance).collect();
        let mean = map.integral(&luminances) / (4.0 * PI);
        if mean <= 0.0 {
            return None;
        }
        let sought: Vec<f64> = luminances.iter().map(|l| l - LEFT_TO_SCATTERING * l.min(mean)).collect();
        let mut pixels = Vec::with_capacity(sought.len());
        let mut row_weights = Vec::with_capacity(map.height);
        for (row, radiance) in map.radiance.chunks(map.width).enumerate() {
            let weights: Vec<f64> =
                (0..map.width).map(|column| neighbourhood(&sought, map.width, row, column)).collect();
            row_weights.push(weights.iter().sum::<f64>() * map.solid_angle(row));
            pixels.extend(radiance.iter().copied().zip(integer_cdf(&weights)));
        }
        Some(Self {
            size: [map.width as u32, map.height as u32],
            pixels,
            rows: integer_cdf(&row_weights),
            rotation: (environment.rotation / 360.0).rem_euclid(1.0) as f32,
            integral: map.integral(&sought),
        })
    }
}

impl Map {
    /// Of a pixel in a row.
    fn solid_angle(&self, row: usize) -> f64 {
        let angle = PI / self.height as f64;
        2.0 * PI / self.width as f64 * ((row as f64 * angle).cos() - ((row + 1) as f64 * angle).cos())
    }

    /// Of a value of each pixel, over all directions.
    fn integral(&self, values: &[f64]) -> f64 {
        values.chunks(self.width).enumerate().map(|(row, v)| v.iter().sum::<f64>() * self.solid_angle(row)).sum()
    }

    /// The same radiance in all directions by more pixels, in each of which it varies less: the density of light samples is constant
    /// in a pixel, and what radiance varies in one is noise that no spreading of samples lowers.
    fn refined(&self) -> Self {
        let (width, height) = (self.width * FINER, self.height * FINER);
        let radiance = (0..width * height).map(|pixel| {
            let (left, x) = between(pixel % width);
            let (top, y) = between(pixel / width);
            let column = |step: isize| (left + step).rem_euclid(self.width as isize) as usize;
            let row = |step: isize| (top + step).clamp(0, self.height as isize - 1) as usize;
            let corner = |dx, dy| self.radiance[row(dy) * self.width + column(dx)];
            let corners = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
            std::array::from_fn(|channel| {
                let [a, b, c, d] = corners.map(|rgb| f64::from(rgb[channel]));
                flush(((a * (1.0 - x) + b * x) * (1.0 - y) + (c * (1.0 - x) + d * x) * y) as f32)
            })
        });
        Self { width, height, radiance: radiance.collect() }
    }
}

/// The last given pixel whose middle is not beyond that of a finer one, and how far the latter is on the way to the next.
fn between(finer: usize) -> (isize, f64) {
    let (twice, step) = (2 * finer as isize + 1 - FINER as isize, 2 * FINER as isize);
    (twice.div_euclid(step), twice.rem_euclid(step) as f64 / step as f64)
}

/// The mean of what interpolation within a pixel sees, weighted 1 2 1 along both axes.
fn neighbourhood(values: &[f64], width: usize, row: usize, column: usize) -> f64 {
    let height = values.len() / width;
    let mut sum = 0.0;
    for (dy, wy) in [0.25, 0.5, 0.25].into_iter().enumerate() {
        let y = (row + dy).saturating_sub(1).min(height - 1);
        for (dx, wx) in [0.25, 0.5, 0.25].into_iter().enumerate() {
            sum += values[y * width + (column + dx + width - 1) % width] * (wx * wy);
        }
    }
    sum
}
