//! Pearson's chi-square test.

use statrs::function::gamma::checked_gamma_ur;

/// Neighbouring cells are pooled until they expect this many counts.
const MIN_EXPECTED: f64 = 5.0;

/// The result of a chi-square test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChiSquare {
    /// Sum of squared deviations over expectations.
    pub statistic: f64,
    /// Cells after pooling, less one.
    pub degrees: f64,
    /// The probability of a statistic at least as large, if the counts follow the expectation.
    pub p: f64,
}

/// Q(a, x) = Gamma(a, x) / Gamma(a); not a number where it is not defined.
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { checked_gamma_ur(a, x).unwrap_or(f64::NAN) }
}

/// Compares counts with expected counts; cells that expect too few are pooled with their neighbours. A count in a
/// cell where nothing is expected gives p = 0, and so does an expectation that is negative or no number.
pub fn chi_square(cells: impl IntoIterator<Item = (u64, f64)>) -> ChiSquare {
    let mut pooled: Vec<(f64, f64)> = Vec::new();
    let mut pending = (0.0, 0.0);
    let mut impossible = false;
    for (count, expected) in cells {
        // so written that an expectation which is no number fails too
        impossible |= !(expected > 0.0 || expected == 0.0 && count == 0);
        pending = (pending.0 + count as f64, pending.1 + expected);
        if pending.1 >= MIN_EXPECTED {
            pooled.push(std::mem::take(&mut pending));
        }
    }
    if let Some(last) = pooled.last_mut() {
        *last = (last.0 + pending.0, last.1 + pending.1);
    }
    let statistic: f64 = pooled.iter().map(|(count, expected)| (count - expected).powi(2) / expected).sum();
    let degrees = pooled.len().saturating_sub(1) as f64;
    let p = if impossible {
        0.0
    } else if degrees == 0.0 {
        1.0
    } else {
        upper_gamma(0.5 * degrees, 0.5 * statistic)
    };
    ChiSquare { statistic, degrees, p }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_p_value() {
        // 95 % quantile for 3 degrees of freedom
        assert!((upper_gamma(1.5, 0.5 * 7.814_727_903_251_179) - 0.05).abs() < 1e-12);
        let even = chi_square([(25, 25.0), (25, 25.0)]);
        assert_eq!((even.statistic, even.degrees), (0.0, 1.0));
        assert!((even.p - 1.0).abs() < 1e-12);
    }

    #[test]
    fn upper_gamma_of_small_integers_is_a_poisson_sum() {
        for x in [0.1_f64, 1.0, 3.0, 10.0, 40.0] {
            let exact = (-x).exp() * (1.0 + x + x * x / 2.0);
            assert!((upper_gamma(3.0, x) / exact - 1.0).abs() < 1e-11, "{x}");
        }
    }

    #[test]
    fn sparse_cells_are_pooled_and_impossible_counts_are_seen() {
        let result = chi_square([(1, 2.0), (4, 3.0), (9, 10.0), (1, 1.0)]);
        assert_eq!(result.degrees, 1.0);
        assert_eq!(chi_square([(10, 10.0), (1, 0.0), (10, 10.0)]).p, 0.0);
    }
}
