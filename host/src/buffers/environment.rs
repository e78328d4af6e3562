//! The environment's pixels and the distribution of its directions.

use super::lights::luminance;
use crate::{distribution::integer_cdf, scene::Environment};
use restir_shared::num::flush;
use std::f64::consts::PI;

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
    /// Of luminance over all directions.
    pub(super) integral: f64,
}

impl EnvironmentMap {
    /// `None` if it is black.
    pub(super) fn new(environment: &Environment) -> Option<Self> {
        let [width, height] = environment.size.map(|side| side as usize);
        let radiance: Vec<[f32; 3]> =
            environment.pixels.iter().map(|rgb| rgb.map(|x| flush(x * environment.scale))).collect();
        let luminances: Vec<f64> = radiance.iter().copied().map(luminance).collect();
        let solid_angle = |row: usize| {
            let angle = PI / height as f64;
            2.0 * PI / width as f64 * ((row as f64 * angle).cos() - ((row + 1) as f64 * angle).cos())
        };
        let integral: f64 =
            luminances.chunks(width).enumerate().map(|(row, l)| l.iter().sum::<f64>() * solid_angle(row)).sum();
        if integral <= 0.0 {
            return None;
        }
        let mut pixels = Vec::with_capacity(radiance.len());
        let mut row_weights = Vec::with_capacity(height);
        for row in 0..height {
            let weights: Vec<f64> = (0..width).map(|column| neighbourhood(&luminances, width, row, column)).collect();
            row_weights.push(weights.iter().sum::<f64>() * solid_angle(row));
            pixels.extend(radiance[row * width..][..width].iter().copied().zip(integer_cdf(&weights)));
        }
        Some(Self {
            size: environment.size,
            pixels,
            rows: integer_cdf(&row_weights),
            rotation: (environment.rotation / 360.0).rem_euclid(1.0) as f32,
            integral,
        })
    }
}

/// The mean luminance of what interpolation within a pixel sees, weighted 1 2 1 along both axes.
fn neighbourhood(luminances: &[f64], width: usize, row: usize, column: usize) -> f64 {
    let height = luminances.len() / width;
    let mut sum = 0.0;
    for (dy, wy) in [0.25, 0.5, 0.25].into_iter().enumerate() {
        let y = (row + dy).saturating_sub(1).min(height - 1);
        for (dx, wx) in [0.25, 0.5, 0.25].into_iter().enumerate() {
            sum += luminances[y * width + (column + dx + width - 1) % width] * (wx * wy);
        }
    }
    sum
}
