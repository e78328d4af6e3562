//! For each distribution X: `sample_x` maps uniform numbers to a value, `x_pdf` is its density, `invert_x` maps
//! the value back to the numbers.

mod alias;
mod hemisphere;
mod triangle;

pub use alias::sample_alias;
pub use hemisphere::{cosine_hemisphere_pdf, invert_cosine_hemisphere, sample_cosine_hemisphere};
pub use triangle::{invert_triangle, sample_triangle, triangle_pdf};
