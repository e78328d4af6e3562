//! Mean and variance of a stream.

use rayon::prelude::*;

/// Count, mean and sum of squared deviations (Welford 1962; merged after Chan, Golub and LeVeque 1979).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// A known value, without variance.
    pub fn exact(value: f64) -> Self {
        Self { count: f64::INFINITY, mean: value, squares: 0.0 }
    }

    /// A value that was measured elsewhere, with its standard error: as the mean of a million values.
    pub fn known(value: f64, error: f64) -> Self {
        let spread = error * 1.0e3;
        Self { count: 1.0e6, mean: value, squares: spread * spread * (1.0e6 - 1.0) }
    }

    /// Count, mean and sum of squared deviations, to be kept.
    pub fn parts(self) -> [f64; 3] {
        [self.count, self.mean, self.squares]
    }

    /// What [`Self::parts`] gave.
    pub fn from_parts([count, mean, squares]: [f64; 3]) -> Self {
        Self { count, mean, squares }
    }

    /// Adds a value.
    pub fn push(&mut self, value: f64) {
        self.count += 1.0;
        let delta = value - self.mean;
        self.mean += delta / self.count;
        self.squares += delta * (value - self.mean);
    }

    /// The moments of both streams.
    #[must_use]
    pub fn merge(self, other: Self) -> Self {
        if other.count == 0.0 {
            return self;
        }
        let count = self.count + other.count;
        let delta = other.mean - self.mean;
        Self {
            count,
            mean: self.mean + delta * (other.count / count),
            squares: self.squares + other.squares + delta * delta * (self.count * other.count / count),
        }
    }

    /// The moments of the values plus a constant.
    #[must_use]
    pub fn shifted(self, by: f64) -> Self {
        Self { mean: self.mean + by, ..self }
    }

    /// The mean.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// The unbiased variance of the values.
    pub fn variance(&self) -> f64 {
        self.squares / (self.count - 1.0)
    }

    /// The variance of the mean; infinite for fewer than two values.
    pub fn variance_of_mean(&self) -> f64 {
        if self.count < 2.0 { f64::INFINITY } else { self.variance() / self.count }
    }

    /// The standard error of the mean.
    pub fn standard_error(&self) -> f64 {
        self.variance_of_mean().sqrt()
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut moments = Self::default();
        values.into_iter().for_each(|value| moments.push(value));
        moments
    }
}

/// Moments of the numbers that each index below `count` gives. They do not depend on how many threads there are: those of
/// `block` indices are made at a time, and merged in their order.
pub fn moments<V: IntoIterator<Item = f64>>(
    count: u64,
    block: u64,
    numbers: usize,
    values: impl Fn(u64) -> V + Sync,
) -> Vec<Moments> {
    let none = || vec![Moments::default(); numbers];
    let of_block = |index: u64| {
        let mut moments = none();
        for i in index * block..count.min((index + 1) * block) {
            moments.iter_mut().zip(values(i)).for_each(|(moments, value)| moments.push(value));
        }
        moments
    };
    let blocks: Vec<_> = (0..count.div_ceil(block)).into_par_iter().map(of_block).collect();
    blocks.into_iter().fold(none(), |sum, block| sum.into_iter().zip(block).map(|(a, b)| a.merge(b)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_merge_to_the_whole() {
        let value = |i: i32| 1e6 + f64::from(i * i % 17);
        let whole: Moments = (0..100).map(value).collect();
        let first: Moments = (0..30).map(value).collect();
        let merged = Moments::default().merge(first).merge((30..100).map(value).collect());
        assert!((whole.mean() - merged.mean()).abs() < 1e-9);
        assert!((whole.variance() / merged.variance() - 1.0).abs() < 1e-9);
        assert_eq!(Moments::exact(2.0).variance_of_mean(), 0.0);
    }
}
