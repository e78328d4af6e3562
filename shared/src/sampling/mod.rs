//! For each distribution X: `sample_x` maps uniform numbers to a value, `x_pdf` is its density, `invert_x` maps
//! the value back to the numbers, always to numbers in [0, 1).
//!
//! | X | values | density over |
//! |---|---|---|
//! | [`cosine_hemisphere`](sample_cosine_hemisphere) | unit vectors, z > 0 | solid angle |
//! | [`uniform_hemisphere`](sample_uniform_hemisphere) | unit vectors, z > 0 | solid angle |
//! | [`uniform_sphere`](sample_uniform_sphere) | unit vectors | solid angle |
//! | [`cone`](sample_cone) | unit vectors around +z | solid angle |
//! | [`henyey_greenstein`](sample_henyey_greenstein) | unit vectors, by the angle to +z | solid angle |
//! | [`concentric_disk`](sample_concentric_disk) | points of the unit disk | area |
//! | [`triangle`](sample_triangle) | barycentric coordinates | area |
//! | [`exponential`](sample_exponential) | distances | length |
//! | [`bounded_exponential`](sample_bounded_exponential) | distances up to a limit | length |
//! | [`blackman_harris`](sample_blackman_harris) | places in a window of width 1 about 0 | length |
//! | [`discrete`](sample_discrete) | indices, by an integer distribution function | counting |
//! | [`table_2d`](sample_table_2d) | cells of a table and positions in them | the unit square |
//! | [`alias`](sample_alias) | indices, by an alias table; without inverse | counting |
//!
//! [`mixture`] inverts what chooses among several of them.
//!
//! ```
//! use restir_shared::glam::Vec2;
//! use restir_shared::num::PI;
//! use restir_shared::sampling::{cosine_hemisphere_pdf, invert_cosine_hemisphere, sample_cosine_hemisphere};
//! use restir_shared::sampling::sample_discrete;
//!
//! // a direction about +z from two uniform numbers, its density, and the numbers again
//! let u = Vec2::new(0.3, 0.7);
//! let direction = sample_cosine_hemisphere(u);
//! assert!((cosine_hemisphere_pdf(direction.z) - direction.z / PI).abs() < 1e-6);
//! assert!((invert_cosine_hemisphere(direction) - u).length() < 1e-5);
//!
//! // one of three items with the probabilities 1/2, 0 and 1/2, by the lower bounds of their shares of 2^32 words
//! let bounds = [0, 1 << 31, 1 << 31];
//! let chosen = sample_discrete(0xc000_0000, 3, |item| bounds[item as usize]);
//! assert_eq!((chosen.index, chosen.probability, chosen.fraction), (2, 0.5, 0.5));
//! ```

mod alias;
mod blackman_harris;
mod cone;
mod discrete;
mod disk;
mod exponential;
mod hemisphere;
mod henyey_greenstein;
pub mod mixture;
mod sphere;
mod table;
mod triangle;

// of the tables in arenas
#[doc(hidden)]
pub use alias::sample_alias;
pub use blackman_harris::{blackman_harris_pdf, invert_blackman_harris, sample_blackman_harris};
#[doc(hidden)]
pub use cone::versine_of_sin2;
pub use cone::{cone_pdf, invert_cone, sample_cone};
#[cfg(not(target_arch = "spirv"))]
#[doc(hidden)]
pub use discrete::find_discrete_each;
#[doc(hidden)]
pub use discrete::{
    CDF_END, Cell, discrete_cell, discrete_probability, find_discrete, invert_discrete, sample_discrete,
};
pub use disk::{concentric_disk_pdf, invert_concentric_disk, sample_concentric_disk};
pub use exponential::{
    bounded_exponential_pdf, exponential_pdf, invert_bounded_exponential, invert_exponential,
    sample_bounded_exponential, sample_exponential,
};
pub use hemisphere::{cosine_hemisphere_pdf, invert_cosine_hemisphere, sample_cosine_hemisphere};
#[doc(hidden)]
pub use henyey_greenstein::{henyey_greenstein_between, henyey_greenstein_scale, henyey_greenstein_shape};
pub use henyey_greenstein::{henyey_greenstein_pdf, invert_henyey_greenstein, sample_henyey_greenstein};
pub use sphere::{
    invert_uniform_hemisphere, invert_uniform_sphere, sample_uniform_hemisphere, sample_uniform_sphere,
    uniform_hemisphere_pdf, uniform_sphere_pdf,
};
#[doc(hidden)]
pub use table::{
    TableSample, find_table_2d, invert_table_2d, sample_table_2d, table_2d_pdf, table_2d_probability, table_2d_sample,
};
pub use triangle::{invert_triangle, sample_triangle, triangle_pdf};

use crate::num;

/// `u` in [0, 1 - 2^-24], where rounding may have left it outside.
#[inline(always)]
fn to_unit(u: f32) -> f32 {
    num::clamp(u, 0.0, 1.0 - num::UNIT_ROUNDOFF)
}

/// The angle of (x, y) in turns, in [0, 1); zero for the origin.
#[inline(always)]
fn azimuth(y: f32, x: f32) -> f32 {
    let turn = num::atan2(y, x);
    to_unit(if turn < 0.0 { turn + 1.0 } else { turn })
}
