//! What got worse since an older table.
//!
//! Runs are compared at equal scene, size, depth, technique and samples: the geometric mean of their times and the mean
//! of their squared errors. A ratio is worse if it is above 1.05 and above what the spread of the restarts explains:
//! three times the 95 % interval of its logarithm (Student's, with the restarts of both tables), which chance passes once
//! in 10^5 with eight restarts. Times of another machine or device are not judged, nor is anything with fewer than two
//! restarts.

use std::collections::BTreeMap;

use super::fit::{mean_and_error, student};
use super::table::Row;

/// Ratios below are never worse.
const TOLERATED: f64 = 1.05;
/// Half widths of the 95 % interval that are left to chance.
const INTERVALS: f64 = 3.0;

/// New over old, and the ratio from which on it is worse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ratio {
    pub(crate) value: f64,
    pub(crate) limit: f64,
}

impl Ratio {
    pub(crate) fn worse(self) -> bool {
        self.value > self.limit
    }
}

/// A cell in both tables; a ratio that cannot be judged is `None`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Change {
    /// One of the new rows.
    pub(crate) row: Row,
    pub(crate) time: Option<Ratio>,
    pub(crate) error: Option<Ratio>,
}

impl Change {
    pub(crate) fn worse(&self) -> bool {
        self.time.is_some_and(Ratio::worse) || self.error.is_some_and(Ratio::worse)
    }
}

/// Compares two tables, over what is in both.
pub(crate) fn compare(old: &[Row], new: &[Row]) -> Vec<Change> {
    let (old, new) = (cells(old), cells(new));
    let both = old.iter().filter_map(|(key, old)| new.get(key).map(|new| (old, new)));
    both.map(|(old, new)| Change { row: new[0].clone(), time: time_ratio(old, new), error: error_ratio(old, new) })
        .collect()
}

/// Rows that should give equal results, together.
fn cells(rows: &[Row]) -> BTreeMap<impl Ord, Vec<&Row>> {
    let mut cells: BTreeMap<_, Vec<&Row>> = BTreeMap::new();
    for row in rows {
        let size = [row.width, row.height];
        let key = (&row.scene, &row.technique, size, row.max_depth, row.jitter, row.spp);
        cells.entry(key).or_default().push(row);
    }
    cells
}

fn time_ratio(old: &[&Row], new: &[&Row]) -> Option<Ratio> {
    let same = old.iter().chain(new).all(|row| (&row.machine, &row.device) == (&new[0].machine, &new[0].device));
    let logarithms = |rows: &[&Row]| mean_and_error(&rows.iter().map(|row| row.seconds.ln()).collect::<Vec<_>>());
    same.then(|| ratio(logarithms(old), logarithms(new), old.len() + new.len())).flatten()
}

fn error_ratio(old: &[&Row], new: &[&Row]) -> Option<Ratio> {
    let logarithm = |rows: &[&Row]| {
        let (mean, error) = mean_and_error(&rows.iter().map(|row| row.mse).collect::<Option<Vec<_>>>()?);
        Some((mean.ln(), error / mean))
    };
    ratio(logarithm(old)?, logarithm(new)?, old.len() + new.len())
}

/// From logarithms with their standard errors, made of `runs` runs.
fn ratio(old: (f64, f64), new: (f64, f64), runs: usize) -> Option<Ratio> {
    let half_width = student(runs.checked_sub(2)?) * old.1.hypot(new.1);
    let difference = new.0 - old.0;
    let known = difference.is_finite() && half_width.is_finite();
    known.then(|| Ratio { value: difference.exp(), limit: (INTERVALS * half_width).exp().max(TOLERATED) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::noise::Noise;

    /// Eight restarts around a time and a squared error, with a spread of 3 %.
    fn rows(seed: u64, seconds: f64, mse: f64) -> Vec<Row> {
        let mut noise = Noise::new(seed);
        let mut around = |value: f64| value * (1.0 + 0.03 * noise.normal());
        (0..8)
            .map(|restart| Row {
                scene: "cornell".to_owned(),
                technique: "path".to_owned(),
                spp: 4,
                restart,
                seconds: around(seconds),
                mse: Some(around(mse)),
                ..Row::default()
            })
            .collect()
    }

    fn only(old: &[Row], new: &[Row]) -> Change {
        let [change] = compare(old, new).try_into().unwrap();
        change
    }

    #[test]
    fn noise_is_not_worse() {
        for seed in 0..200 {
            let change = only(&rows(2 * seed, 1.0, 0.1), &rows(2 * seed + 1, 1.0, 0.1));
            assert!(change.time.is_some() && change.error.is_some());
            assert!(!change.worse(), "{change:?}");
        }
    }

    #[test]
    fn a_fifth_more_is_worse_and_less_is_not() {
        let old = rows(1, 1.0, 0.1);
        let slower = only(&old, &rows(2, 1.2, 0.1));
        assert!(slower.time.unwrap().worse() && !slower.error.unwrap().worse());
        let noisier = only(&old, &rows(3, 1.0, 0.12));
        assert!(!noisier.time.unwrap().worse() && noisier.error.unwrap().worse());
        assert!(!only(&old, &rows(4, 0.8, 0.08)).worse());
    }

    #[test]
    fn what_cannot_be_judged_is_not() {
        let old = rows(1, 1.0, 0.1);
        let changed = |change: fn(&mut Row)| {
            let mut rows = rows(2, 9.0, 0.1);
            rows.iter_mut().for_each(change);
            rows
        };
        assert_eq!(only(&old, &changed(|row| row.machine = "another".to_owned())).time, None);
        assert_eq!(only(&old, &changed(|row| row.mse = None)).error, None);
        assert_eq!(only(&old, &changed(|_| ())[..1]).time, None);
        assert_eq!(compare(&old, &changed(|row| row.spp = 8)), []);
    }
}
