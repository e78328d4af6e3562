//! A parallel loop over inputs that keeps the worst error.

use rayon::prelude::*;

/// Inputs that one task visits.
const CHUNK: u64 = 1 << 15;

/// What a sweep found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tally {
    /// How many inputs were tested.
    pub inputs: u64,
    /// How many had an error beyond the limit.
    pub failures: u64,
    /// The largest error.
    pub worst: f64,
    /// The input with the largest error: the bits of one operand, or of two, the first in the high word.
    pub worst_input: u64,
    limit: f64,
}

impl Tally {
    fn new(limit: f64) -> Self {
        Self { inputs: 0, failures: 0, worst: 0.0, worst_input: 0, limit }
    }

    /// One input; an error that is not a number is a failure.
    pub fn record(&mut self, input: u64, error: f64) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        self.inputs += 1;
        self.failures += u64::from(error > self.limit);
        if error > self.worst {
            self.worst = error;
            self.worst_input = input;
        }
    }

    /// One input with a result that is right or wrong.
    pub fn check(&mut self, input: u64, right: bool) {
        self.record(input, if right { 0.0 } else { f64::INFINITY });
    }

    /// Of equal errors the one of the smaller input is kept, so that the result does not depend on the schedule.
    pub(super) fn merge(self, other: Self) -> Self {
        let mine = self.worst > other.worst || (self.worst == other.worst && self.worst_input <= other.worst_input);
        let worst = if mine { self } else { other };
        Self { inputs: self.inputs + other.inputs, failures: self.failures + other.failures, ..worst }
    }
}

/// Calls `visit` for every index below `count`; it records its inputs in one of `N` tallies.
pub(super) fn sweep<const N: usize>(count: u64, limit: f64, visit: impl Fn(u64, &mut [Tally; N]) + Sync) -> [Tally; N] {
    let empty = || [Tally::new(limit); N];
    let chunk = |index: u64| {
        let mut tallies = empty();
        for i in index * CHUNK..count.min((index + 1) * CHUNK) {
            visit(i, &mut tallies);
        }
        tallies
    };
    (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(chunk)
        .reduce(empty, |a, b| std::array::from_fn(|i| a[i].merge(b[i])))
}
