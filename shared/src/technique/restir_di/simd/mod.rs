//! ReSTIR DI for processors with wide registers: the passes over a row of pixels, with the same bits as pixel by pixel.
//!
//! * [`primary_row`] traces the camera rays of as many pixels as there are lanes as one beam.
//! * [`initial_row`] looks at as many points at once, scatters there, and weighs as many candidates of each pixel. The choice among them depends on
//!   those before, and goes one by one.
//! * [`combine_row`] and [`exchange_row`] evaluate samples of pixels at other pixels. They list these samples first, evaluate them as many at a time as
//!   there are lanes ([`evaluated`]), and then go pixel by pixel as elsewhere, but look evaluations up.

mod combine;
mod evaluated;
mod exchange;
mod initial;
mod primary;
mod read;

pub use combine::combine_row;
pub use exchange::exchange_row;
pub use initial::initial_row;
pub use primary::primary_row;

use crate::geometry::Hit;
use crate::lanes::soa;

/// The pixel (x, y), which sees `hit`.
#[derive(Clone, Copy)]
struct Looking {
    x: u32,
    y: u32,
    hit: Hit,
}

soa! { ManyLooking = Looking { x: u32, y: u32, hit: Hit } }
