//! What techniques that reuse samples have in common, whatever a sample is.
//!
//! A pixel keeps one sample out of many in a [`reservoir`]. A technique says what a sample is, how it moves from pixel to pixel and
//! what it contributes there ([`domain`]). How reservoirs become one ([`merge`], with the weights of [`mis`]), where others are found
//! ([`reproject`], [`pairing`], [`similar`]), how pixels shade by each other's samples ([`exchange`]), and how reservoirs lie in buffers ([`packed`]),
//! is said here once.
//!
//! ```
//! use restir_shared::resample::mis::{Combine, Mis};
//! use restir_shared::resample::reservoir::Reservoir;
//!
//! // Two pixels want the function x² of numbers in [0, 1), whose integral is 1/3. Each has streamed candidates and kept one.
//! let target = |x: f64| x * x;
//! let streamed = |first: u32| {
//!     let mut reservoir = Reservoir::empty(0.0);
//!     for i in 0..1000 {
//!         let (x, u) = (f64::from(i * 2 + first) / 2000.0, f64::from(i * 389 % 1000) / 1000.0);
//!         reservoir.update(x, target(x), 1.0, u);
//!     }
//!     reservoir
//! };
//! let inputs = [streamed(0), streamed(1)];
//!
//! // the weights of their samples, by which one of the two is selected, add up to the estimate of both
//! let mut combine = Combine::new(Mis::CONSTANT, 1.0);
//! for input in inputs {
//!     let weight = input.contribution_weight(1.0 / input.confidence, target(input.sample));
//!     combine.input(input.confidence, target(input.sample) * weight);
//! }
//! assert_eq!(combine.confidence(), 2000.0);
//! assert!((combine.weight(0) + combine.weight(1) - 1.0 / 3.0).abs() < 1e-3);
//! ```

pub mod domain;
#[doc(hidden)]
pub mod exchange;
pub(crate) mod matrix;
pub mod merge;
pub mod mis;
pub mod mutual;
#[doc(hidden)]
pub mod packed;
#[doc(hidden)]
pub mod pairing;
pub mod params;
pub mod reproject;
pub mod reservoir;
mod shifted;
pub mod similar;
