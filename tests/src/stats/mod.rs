//! Statistics for samplers and renderers, for this project's suites and for an embedder's own: the chi-square test,
//! the Kolmogorov-Smirnov test, z-tests with their power, and the [domains](Domain) over which a density integrates.
//!
//! Every test states its rate of false alarms; where a test is one of a [`Family`], the rate is that of the family
//! (Šidák's correction). Seeds are fixed, so a test that passes keeps passing. A test that fails leaves its table in a
//! file that the message names.
//!
//! A sampler is tested against its density in a few lines. Points are numbers or arrays of `f64`; draws are numbered,
//! and each makes its random numbers of its index:
//!
//! ```
//! use restir_tests::random::SplitMix;
//! use restir_tests::stats::{Cap, Family, SamplerTest};
//!
//! // a lobe around +z with density 3 cos^2 / 2 pi: its z is the cube root of a uniform number
//! let sample = |index: u64| {
//!     let mut random = SplitMix::new(index);
//!     let (z, turn) = (random.unit().cbrt(), random.unit());
//!     let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
//!     let r = (1.0 - z * z).sqrt();
//!     Some([r * cos, r * sin, z])
//! };
//! let pdf = |w: &[f64; 3]| 3.0 * w[2] * w[2] / std::f64::consts::TAU;
//!
//! let test = SamplerTest { domain: Cap::HEMISPHERE, cells: [16, 32], draws: 100_000 };
//! assert!((test.integral(pdf) - 1.0).abs() < 1e-6);
//!
//! let mut family = Family::new("my lobe", 1e-3);
//! family.chi_square("z and angle", test.table(sample, pdf));
//! family.verdict().unwrap();
//!
//! // a test that cannot fail shows nothing: the density of another lobe must be refused
//! let mut wrong = Family::new("my lobe, wrong", 1e-3);
//! wrong.chi_square("z and angle", test.table(sample, |w| w[2] / std::f64::consts::PI));
//! assert!(!wrong.passed());
//! ```

mod chi_square;
mod domain;
pub mod effort;
mod family;
mod kolmogorov;
mod moments;
mod normal;
mod quadrature;
mod sampler;
mod tiles;
mod z_test;

pub use chi_square::chi_square;
pub use domain::{Cap, Disk, Domain, Line, Triangle};
pub use family::{FAMILY_RATE, Family};
pub use kolmogorov::kolmogorov;
pub use moments::{Moments, moments};
pub use normal::{POWER, detectable_bias, sidak, two_sided_p, two_sided_threshold, upper_tail, upper_tail_quantile};
pub use sampler::SamplerTest;
pub use tiles::{TileGrid, TileTest, Verdict};
pub use z_test::ZTest;
