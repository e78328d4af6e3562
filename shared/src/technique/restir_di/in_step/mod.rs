//! ReSTIR DI for processors with wide registers: what the passes compute of many samples, in step, with the same bits as one by one.
//!
//! What depends on what came before stays one by one: the choice among candidates, and the sums over reservoirs. Candidates of one pixel are
//! weighed together ([`initial_row`]). Of the passes that evaluate samples of several pixels at several others ([`combine_row`], [`exchange_row`]),
//! the samples of some pixels are listed first, then evaluated as many at a time as there are lanes ([`evaluated`]), and the pass asks for the
//! evaluations instead of making them.

mod combine;
mod evaluated;
mod exchange;
mod initial;
mod primary;

pub use combine::combine_row;
pub use exchange::exchange_row;
pub use initial::initial_row;
pub use primary::primary_row;

use crate::geometry::Hit;
use crate::lanes::fields;

/// The pixel (x, y), which sees `hit`.
#[derive(Clone, Copy)]
struct Looking {
    x: u32,
    y: u32,
    hit: Hit,
}

fields! { ManyLooking = Looking { x: u32, y: u32, hit: Hit } }
