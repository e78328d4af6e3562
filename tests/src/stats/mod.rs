//! Statistics of the suites: moments, tail probabilities, the chi-square test, z-tests per tile with their power.
//!
//! Every test states its rate of false alarms; where a test is a family of many, the rate is that of the family
//! (Šidák's correction).

mod chi_square;
mod gamma;
mod moments;
mod normal;
mod tiles;

pub use chi_square::{ChiSquare, chi_square};
pub use gamma::{ln_gamma, upper_gamma};
pub use moments::Moments;
pub use normal::{detectable_bias, sidak, two_sided_p, two_sided_threshold, upper_tail, upper_tail_quantile};
pub use tiles::{TileGrid, TileTest, Verdict};
