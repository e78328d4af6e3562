//! Pearson's chi-square test.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Neighbouring cells are pooled until they expect this many counts.
const MIN_EXPECTED: f64 = 5.0;

/// The probability that counts which follow their expectations deviate at least as much from them as the given ones. Cells
/// that expect too few are pooled with their neighbours. A count in a cell where nothing is expected has the probability 0,
/// and so has an expectation that is negative or no number.
pub fn chi_square(cells: impl IntoIterator<Item = (u64, f64)>) -> f64 {
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
    if impossible {
        return 0.0;
    }
    let statistic = pooled.iter().map(|(count, expected)| (count - expected).powi(2) / expected).sum();
    let degrees = pooled.len().saturating_sub(1);
    // a single cell cannot deviate
    ChiSquared::new(degrees as f64).map_or(1.0, |distribution| distribution.sf(statistic))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_p_values() {
        assert_eq!(chi_square([(25, 25.0), (25, 25.0)]), 1.0);
        assert_eq!(chi_square([(25, 20.0)]), 1.0);
        // 10 with 4 degrees of freedom: exp(-10 / 2) (1 + 10 / 2)
        let p = chi_square([30, 10, 20, 20, 20].map(|count| (count, 20.0)));
        assert!((p - 0.040_427_681_994_512_8).abs() < 1e-12, "{p}");
    }

    #[test]
    fn sparse_cells_are_pooled_and_impossible_counts_are_seen() {
        // 1 / 11 with one degree of freedom
        let p = chi_square([(1, 2.0), (4, 3.0), (9, 10.0), (1, 1.0)]);
        assert!((p - 0.763_024_600_552_995).abs() < 1e-12, "{p}");
        assert_eq!(chi_square([(10, 10.0), (1, 0.0), (10, 10.0)]), 0.0);
    }
}
