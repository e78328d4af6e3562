//! Alias tables (Walker 1977; construction after Vose 1991).

/// Weights that differ by less than this fraction are drawn uniformly, without a table.
const EQUAL: f64 = 1.0e-6;
/// Random numbers are multiples of 2^-24, so thresholds are too.
const STEPS: f64 = 16_777_216.0;

/// An entry: the index itself below the threshold, else the alias.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Entry {
    /// In [0, 1], a multiple of 2^-24.
    pub threshold: f32,
    /// The other index.
    pub alias: u32,
}

/// The table for the given positive weights; `None` where they are equal and a uniform choice is enough.
pub(crate) fn build(weights: &[f64]) -> Option<Vec<Entry>> {
    let (lo, hi) = weights.iter().fold((f64::INFINITY, 0.0_f64), |(lo, hi), &w| (lo.min(w), hi.max(w)));
    if weights.is_empty() || hi - lo <= EQUAL * hi {
        return None;
    }
    let mean = weights.iter().sum::<f64>() / weights.len() as f64;
    let mut rest: Vec<f64> = weights.iter().map(|w| w / mean).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..rest.len()).partition(|&i| rest[i] < 1.0);
    let mut table: Vec<Entry> = (0..rest.len()).map(|i| Entry { threshold: 1.0, alias: i as u32 }).collect();
    while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
        small.pop();
        table[s] = Entry { threshold: ((rest[s] * STEPS).round() / STEPS) as f32, alias: l as u32 };
        rest[l] -= 1.0 - rest[s];
        if rest[l] < 1.0 {
            large.pop();
            small.push(l);
        }
    }
    Some(table)
}

/// The probability with which each of `count` indices is drawn: exact for the table as it is, rounded thresholds
/// included, so that densities made of it are unbiased.
pub(crate) fn probabilities(count: usize, table: Option<&[Entry]>) -> Vec<f64> {
    let share = 1.0 / count as f64;
    let Some(table) = table else { return vec![share; count] };
    let mut p = vec![0.0; count];
    for (i, entry) in table.iter().enumerate() {
        let own = f64::from(entry.threshold);
        p[i] += own * share;
        p[entry.alias as usize] += (1.0 - own) * share;
    }
    p
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_reproduces_its_weights() {
        let weights = [1.0, 2.0, 0.001, 7.5, 7.5, 1.0e-3, 100.0];
        let total: f64 = weights.iter().sum();
        let table = build(&weights).expect("unequal weights");
        for (p, w) in probabilities(weights.len(), Some(&table)).iter().zip(weights) {
            // a threshold is off by at most half a step, and a heavy index is the alias of at most all others
            assert!((p - w / total).abs() <= 0.5 / STEPS, "{p} for {w}");
        }
    }

    #[test]
    fn equal_weights_need_no_table() {
        assert!(build(&[3.0, 3.0, 3.0]).is_none());
        assert_eq!(probabilities(3, None), vec![1.0 / 3.0; 3]);
    }
}
