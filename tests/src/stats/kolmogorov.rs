//! The one-sample test of Kolmogorov and Smirnov.

/// The probability that the empirical distribution function of values that follow a continuous one is as far from it as that
/// of the sorted values. It is Kolmogorov's limit with Stephens' correction for finite samples (1970), good to some per cent
/// of itself from 10 values on.
pub fn kolmogorov(sorted: &[f64], cdf: impl Fn(f64) -> f64) -> f64 {
    let n = sorted.len() as f64;
    let distance_at = |(i, x): (usize, &f64)| {
        let expected = cdf(*x);
        let distance = (expected - i as f64 / n).max((i + 1) as f64 / n - expected);
        if distance.is_nan() { 1.0 } else { distance }
    };
    let distance = sorted.iter().enumerate().map(distance_at).fold(0.0, f64::max);
    let root = n.sqrt();
    limit((root + 0.12 + 0.11 / root) * distance)
}

/// P(K > x) for Kolmogorov's distribution.
fn limit(x: f64) -> f64 {
    if x < 0.2 {
        // the series converges slowly, to less than 10^-12 from 1
        return 1.0;
    }
    let term = |k: i32| f64::from(1 - 2 * (k & 1)) * (-2.0 * f64::from(k * k) * x * x).exp();
    (-2.0 * (1..60).map(term).sum::<f64>()).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix;

    #[test]
    fn known_quantiles() {
        // Smirnov's table
        for (x, p) in [(1.223_848, 0.10), (1.358_099, 0.05), (1.627_624, 0.01), (1.949_475, 0.001)] {
            assert!((limit(x) / p - 1.0).abs() < 1e-4, "{x}: {}", limit(x));
        }
        assert!(limit(0.2) > 1.0 - 1e-9 && limit(0.1) == 1.0);
    }

    #[test]
    fn uniform_numbers_pass_and_others_do_not() {
        let mut random = SplitMix::new(1);
        let mut values: Vec<f64> = (0..10_000).map(|_| random.unit()).collect();
        values.sort_by(f64::total_cmp);
        assert!(kolmogorov(&values, |x| x) > 1e-3);
        assert!(kolmogorov(&values, |x| x.powf(1.05)) < 1e-3);
        assert!(kolmogorov(&values, |_| f64::NAN) < 1e-3);
    }
}
