//! Confidence intervals by the bootstrap (Efron 1979): a statistic of measured things is computed again for things that are drawn from them with
//! replacement, and scatters among these draws as it does about the truth.
//!
//! ```
//! use restir_lab::bootstrap::{Interval, mean};
//!
//! // run times in seconds, and the 95 % interval of their mean
//! let seconds = [1.02, 0.97, 1.05, 1.01, 0.99, 1.00, 0.96, 1.04];
//! let interval = Interval::of_positive(seconds.len(), 1000, |times| mean(&seconds, times));
//! assert!((interval.value - 1.005).abs() < 1e-9);
//! assert!(interval.ends[0] < interval.value && interval.value < interval.ends[1]);
//!
//! // it is faster than a run of 1.2 seconds; whether it is faster than one of 1.0 is not decided
//! assert_eq!(interval.inside(0.0, 1.2), Some(true));
//! assert_eq!(interval.inside(0.0, 1.0), None);
//! ```

use restir_shared::glam::UVec4;
use restir_shared::rng::pcg4d;

/// A number and its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The number.
    pub value: f64,
    /// Lower and upper end.
    pub ends: [f64; 2],
}

impl Interval {
    /// The basic bootstrap interval: the resampled statistic scatters around its value for what is resampled from
    /// (`center`) as the statistic does around the truth.
    pub fn basic(value: f64, center: f64, mut resampled: Vec<f64>) -> Self {
        resampled.sort_by(f64::total_cmp);
        let quantile = |q: f64| resampled[((resampled.len() - 1) as f64 * q).round() as usize] - center;
        Self { value, ends: [value - quantile(0.975), value - quantile(0.025)] }
    }

    /// The interval of a positive statistic of `count` things, as the basic interval of its logarithm, from `resamples` draws;
    /// `statistic` gets how often each thing counts.
    pub fn of_positive(count: usize, resamples: u32, statistic: impl Fn(&[f64]) -> f64) -> Self {
        let log = |times: &[f64]| statistic(times).ln();
        let value = log(&vec![1.0; count]);
        let resampled = (0..resamples).map(|seed| log(&draws(seed, count))).collect();
        let Self { value, ends } = Self::basic(value, value, resampled);
        Self { value: value.exp(), ends: ends.map(f64::exp) }
    }

    /// Whether the truth lies between `low` and `high`; `None` if the interval does not decide it.
    pub fn inside(&self, low: f64, high: f64) -> Option<bool> {
        let [first, last] = self.ends;
        let (inside, outside) = (first > low && last < high, last <= low || first >= high);
        (inside || outside).then_some(inside)
    }
}

impl std::fmt::Display for Interval {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.3} [{:.3}, {:.3}]", self.value, self.ends[0], self.ends[1])
    }
}

/// How often each of `count` things is drawn in `count` draws; a function of the seed.
pub fn draws(seed: u32, count: usize) -> Vec<f64> {
    let mut times = vec![0.0; count];
    for draw in 0..count {
        let word = pcg4d(UVec4::new(seed, draw as u32, 0, 0)).x;
        times[((u64::from(word) * count as u64) >> 32) as usize] += 1.0;
    }
    times
}

/// The mean of `values` that count `times` each.
pub fn mean(values: &[f64], times: &[f64]) -> f64 {
    let sum: f64 = values.iter().zip(times).map(|(value, times)| value * times).sum();
    sum / times.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_holds_the_truth_as_often_as_it_says() {
        // exponential numbers of mean 1; 95 % of 300 are 285, less the few that the basic interval lacks for 40 of them
        let unit = |trial: u32, i: u32| (f64::from(pcg4d(UVec4::new(trial, i, 7, 9)).x) + 0.5) * 2.0_f64.powi(-32);
        let held = (0..300).filter(|&trial| {
            let values: Vec<f64> = (0..40).map(|i| -unit(trial, i).ln()).collect();
            Interval::of_positive(40, 200, |times| mean(&values, times)).inside(1.0, 1.0) != Some(false)
        });
        let held = held.count();
        assert!((265..=296).contains(&held), "{held}");
    }

    #[test]
    fn an_interval_decides_only_what_it_excludes() {
        let interval = Interval { value: 2.0, ends: [1.0, 3.0] };
        assert_eq!(interval.inside(0.0, 4.0), Some(true));
        assert_eq!(interval.inside(3.5, 9.0), Some(false));
        assert_eq!(interval.inside(1.5, 9.0), None);
    }

    #[test]
    fn draws_count_as_many_as_there_are() {
        for seed in 0..9 {
            assert_eq!(draws(seed, 32).iter().sum::<f64>(), 32.0);
        }
        assert_ne!(draws(0, 32), draws(1, 32));
    }
}
