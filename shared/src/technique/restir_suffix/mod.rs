//! Suffix ReSTIR.

mod gather;
mod grid;
mod keep;
mod params;
mod prefix;
mod suffix;

pub use gather::{Asks, Lent, Throughput, ask, begin};
pub use grid::{MAX_BORROWED, Nearest, PrefixGrid, PrefixPoint};
pub use keep::{Kept, keep};
pub use params::SuffixParams;
pub use prefix::{EndRule, Prefix, prefix};
pub use suffix::suffix;
