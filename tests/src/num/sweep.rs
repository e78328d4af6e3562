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
        self.record(input, error_unless(right));
    }

    /// Of equal errors the one of the smaller input is kept, so that the result does not depend on the schedule.
    pub(super) fn merge(self, other: Self) -> Self {
        let mine = self.worst > other.worst || (self.worst == other.worst && self.worst_input <= other.worst_input);
        let worst = if mine { self } else { other };
        Self { inputs: self.inputs + other.inputs, failures: self.failures + other.failures, ..worst }
    }
}

/// The error of a result that is right or wrong.
pub(super) fn error_unless(right: bool) -> f64 {
    if right { 0.0 } else { f64::INFINITY }
}

/// Calls `visit` for every index below `count`; it records its inputs in the tally.
pub(super) fn sweep(count: u64, limit: f64, visit: impl Fn(u64, &mut Tally) + Sync) -> Tally {
    let [tally] = sweep_all(count, limit, |i, [tally]| visit(i, tally));
    tally
}

/// The same for every bit pattern that is a multiple of `stride`.
pub(super) fn sweep_patterns(stride: u64, limit: f64, visit: impl Fn(u32, &mut Tally) + Sync) -> Tally {
    sweep((1_u64 << 32).div_ceil(stride), limit, |i, tally| visit((i * stride) as u32, tally))
}

/// The same for all pairs of `edges` and for `count` others; `error` gives nothing for a pair that is not tested.
pub(super) fn sweep_pairs(
    count: u64,
    limit: f64,
    edges: &[f32],
    other: fn(u64) -> (f32, f32),
    error: impl Fn(f32, f32) -> Option<f64> + Sync,
) -> Tally {
    let visit = |(a, b): (f32, f32), tally: &mut Tally| {
        if let Some(error) = error(a, b) {
            tally.record(u64::from(a.to_bits()) << 32 | u64::from(b.to_bits()), error);
        }
    };
    sweep(count, limit, |i, tally| {
        if i == 0 {
            edges.iter().for_each(|&a| edges.iter().for_each(|&b| visit((a, b), tally)));
        }
        visit(other(i), tally);
    })
}

/// The same as [`sweep`] with one of `N` tallies.
pub(super) fn sweep_all<const N: usize>(
    count: u64,
    limit: f64,
    visit: impl Fn(u64, &mut [Tally; N]) + Sync,
) -> [Tally; N] {
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
