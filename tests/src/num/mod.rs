//! Sweeps of [`restir_shared::num`]: are divisions and roots correctly rounded, and how far off are the elementary
//! functions?
//!
//! The checks take the function as an argument, so that a test can show that they see a wrong one.

pub mod accuracy;
pub mod exact;
pub mod mantissa;
pub mod rounding;
mod sweep;
mod table;

pub use sweep::Tally;
pub use table::{Row, markdown};

/// The largest error in units in the last place that an elementary function may have.
pub const MAX_ULP: f64 = 2.0;

/// How much a sweep covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// A regular subset, for the test suite.
    Reduced,
    /// Everything that the table in DETERMINISM.md promises.
    Full,
}

impl Effort {
    /// The step of a regular subset: 1 for a full sweep.
    fn stride(self, reduced: u64) -> u64 {
        match self {
            Self::Reduced => reduced,
            Self::Full => 1,
        }
    }
}

/// All sweeps.
pub fn rows(effort: Effort) -> Vec<Row> {
    let mut rows = rounding::rows(effort);
    rows.extend(mantissa::rows(effort));
    rows.extend(accuracy::rows(effort));
    rows
}
