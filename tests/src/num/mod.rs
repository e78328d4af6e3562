//! Sweeps of [`restir_shared::num`]: are divisions and roots correctly rounded, and how far off are the elementary
//! functions?
//!
//! The checks take the function as an argument, so that a test can show that they see a wrong one.

pub mod accuracy;
pub mod exact;
pub mod mantissa;
pub mod packing;
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

/// The sweeps of one function, or of those that share its inputs.
pub struct Sweep {
    /// The function.
    pub function: &'static str,
    run: Box<dyn Fn(Effort) -> Vec<Row>>,
}

impl Sweep {
    fn new(function: &'static str, run: impl Fn(Effort) -> Vec<Row> + 'static) -> Self {
        Self { function, run: Box::new(run) }
    }

    /// Runs them.
    pub fn rows(&self, effort: Effort) -> Vec<Row> {
        (self.run)(effort)
    }
}

/// All sweeps, in the order of the table.
pub fn sweeps() -> Vec<Sweep> {
    let mut sweeps = rounding::sweeps();
    sweeps.push(Sweep::new("corrections", mantissa::rows));
    sweeps.extend(accuracy::sweeps());
    sweeps
}
