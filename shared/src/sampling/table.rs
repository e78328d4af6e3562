//! A piecewise-constant density over the unit square, such as the luminance of an environment map: a row by the
//! marginal distribution, then a column by the row's.

use super::{discrete_cell, discrete_probability, find_discrete, invert_discrete};
use glam::Vec2;

/// A chosen cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableSample {
    /// Column and row.
    pub cell: [u32; 2],
    /// Position within the cell, in (0, 1)^2.
    pub fraction: Vec2,
    /// Probability of the cell.
    pub probability: f32,
}

/// Chooses a cell by two random words and a position in it by what is left of them. `row_cdf(row)` bounds the rows,
/// `column_cdf(row, column)` the columns of a row, both as for [`sample_discrete`](super::sample_discrete); no side is zero.
#[inline(always)]
pub fn sample_table_2d(
    words: [u32; 2],
    width: u32,
    height: u32,
    row_cdf: impl Fn(u32) -> u32,
    column_cdf: impl Fn(u32, u32) -> u32,
) -> TableSample {
    let cell = find_table_2d(words, width, height, &row_cdf, &column_cdf);
    table_2d_sample(cell, words, width, height, row_cdf, column_cdf)
}

/// The cell, [column, row], that [`sample_table_2d`] chooses.
#[inline(always)]
pub fn find_table_2d(
    words: [u32; 2],
    width: u32,
    height: u32,
    row_cdf: impl Fn(u32) -> u32,
    column_cdf: impl Fn(u32, u32) -> u32,
) -> [u32; 2] {
    let row = find_discrete(words[0], height, row_cdf);
    [find_discrete(words[1], width, |column| column_cdf(row, column)), row]
}

/// What [`sample_table_2d`] makes of a cell, [column, row], which is the one that it chooses.
#[inline(always)]
pub fn table_2d_sample(
    cell: [u32; 2],
    words: [u32; 2],
    width: u32,
    height: u32,
    row_cdf: impl Fn(u32) -> u32,
    column_cdf: impl Fn(u32, u32) -> u32,
) -> TableSample {
    let row = discrete_cell(cell[1], words[0], height, row_cdf);
    let column = discrete_cell(cell[0], words[1], width, |column| column_cdf(cell[1], column));
    TableSample {
        cell,
        fraction: Vec2::new(column.fraction, row.fraction),
        probability: row.probability * column.probability,
    }
}

/// The probability of a cell, [column, row].
#[inline(always)]
pub fn table_2d_probability(
    cell: [u32; 2],
    width: u32,
    height: u32,
    row_cdf: impl Fn(u32) -> u32,
    column_cdf: impl Fn(u32, u32) -> u32,
) -> f32 {
    let column = |column: u32| column_cdf(cell[1], column);
    discrete_probability(cell[1], height, row_cdf) * discrete_probability(cell[0], width, column)
}

/// The density over the unit square in a cell of the given probability; sides are below 2^16.
#[inline(always)]
pub fn table_2d_pdf(probability: f32, width: u32, height: u32) -> f32 {
    probability * (width as f32 * height as f32)
}

/// The words of which [`sample_table_2d`] makes the cell, which has a probability, and the position in it.
#[inline(always)]
pub fn invert_table_2d(
    cell: [u32; 2],
    fraction: Vec2,
    width: u32,
    height: u32,
    row_cdf: impl Fn(u32) -> u32,
    column_cdf: impl Fn(u32, u32) -> u32,
) -> [u32; 2] {
    let column = |column: u32| column_cdf(cell[1], column);
    [invert_discrete(cell[1], fraction.y, height, row_cdf), invert_discrete(cell[0], fraction.x, width, column)]
}
