//! Whether reuse pays: errors at equal run time.
//!
//! Samples without reuse are independent, so that their squared error times run time is a constant. The baseline of a scene
//! is the technique without reuse for which it is smallest. It is compared with any other as if it had run for the time
//! that the other took for its largest number of samples.

use super::fit::{Estimate, mean_and_error, student};
use super::{Cell, SceneResult, Series, error::Truth};

/// A technique beside the baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Comparison {
    /// Run time of a sample, of the baseline's.
    pub(crate) time: f64,
    /// relMSE, of the baseline's after the same time; 1 for the baseline itself. The interval is of its logarithm.
    pub(crate) error: Estimate,
    pub(crate) reuses: bool,
}

impl Comparison {
    /// Whether the error is smaller than that of the same time without reuse: `None` if the interval does not tell.
    pub(crate) fn pays(&self) -> Option<bool> {
        let logarithm = self.error.value.ln();
        (logarithm.abs() > self.error.half_width).then_some(logarithm < 0.0)
    }
}

/// The baseline's index and each technique's comparison with it, `None` where the reference cannot judge. `None` if no
/// technique is without reuse, or if all are.
pub(crate) fn compare(result: &SceneResult) -> Option<(usize, Vec<Option<Comparison>>)> {
    let reuses = |series: &Series| series.technique.render.technique.reuses();
    if !result.series.iter().any(reuses) {
        return None;
    }
    let costs: Vec<Option<Cost>> = result.series.iter().map(|series| Cost::of(series, &result.truth)).collect();
    let known = costs.iter().enumerate().filter_map(|(i, cost)| cost.map(|cost| (i, cost)));
    let may_be = |i: usize| !reuses(&result.series[i]) && result.series[i].technique.render.is_mean();
    let (index, baseline) = known.filter(|(i, _)| may_be(*i)).min_by(|(_, a), (_, b)| a.value.total_cmp(&b.value))?;
    let comparison = |(series, cost): (&Series, &Option<Cost>)| {
        cost.map(|cost| Comparison {
            time: cost.sample_seconds / baseline.sample_seconds,
            error: cost.over(&baseline),
            reuses: reuses(series),
        })
    };
    Some((index, result.series.iter().zip(&costs).map(comparison).collect()))
}

/// relMSE times seconds, at the largest number of samples.
#[derive(Clone, Copy)]
struct Cost {
    value: f64,
    /// Standard error of its logarithm: over restarts, and of the reference's noise.
    error: f64,
    restarts: usize,
    sample_seconds: f64,
}

impl Cost {
    fn of(series: &Series, truth: &Truth) -> Option<Self> {
        let cell: &Cell = series.cells.last()?;
        let error = cell.rel_mse(truth).corrected()?;
        let errors: Vec<f64> = cell.runs.iter().map(|run| run.errors.rel_mse).collect();
        let seconds = cell.seconds();
        Some(Self {
            value: error * seconds,
            error: mean_and_error(&errors).1.hypot(truth.noise_errors[1]) / error,
            restarts: errors.len(),
            sample_seconds: seconds / f64::from(cell.samples),
        })
    }

    fn over(&self, baseline: &Self) -> Estimate {
        let freedom = (self.restarts + baseline.restarts).saturating_sub(2);
        Estimate { value: self.value / baseline.value, half_width: student(freedom) * self.error.hypot(baseline.error) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::tests::furnace;
    use restir::technique::{self, Technique};
    use restir::{render::Render, technique::path::PathSettings};

    /// A technique that reuses.
    fn reusing() -> Box<dyn Technique> {
        technique::all().into_iter().find(|technique| technique.reuses()).unwrap()
    }

    /// The furnace's two techniques, the second one taken for another, with times and errors as given.
    fn result(technique: impl Into<Box<dyn Technique>>, seconds: [f64; 2], scale: f64) -> SceneResult {
        let mut result = furnace();
        result.series[1].technique.render = Render { accumulate: true, ..Render::new([16, 16], technique) };
        let noise = result.truth.relative_noise;
        let errors: Vec<f64> = result.series[0].cells[4].runs.iter().map(|run| run.errors.rel_mse).collect();
        for (series, seconds) in result.series.iter_mut().zip(seconds) {
            series.cells[4].runs.iter_mut().for_each(|run| run.seconds = seconds);
        }
        for (run, error) in result.series[1].cells[4].runs.iter_mut().zip(errors) {
            run.errors.rel_mse = (error - noise) * scale + noise;
        }
        result
    }

    #[test]
    fn half_the_error_in_the_same_time_pays_and_in_thrice_the_time_does_not() {
        for (seconds, pays) in [([1.0, 1.0], true), ([1.0, 6.0], false)] {
            let (baseline, all) = compare(&result(reusing(), seconds, 0.5)).unwrap();
            let [path, restir] = [0, 1].map(|i: usize| all[i].unwrap());
            assert_eq!((baseline, path.error.value, path.reuses, restir.reuses), (0, 1.0, false, true));
            assert!((restir.error.value - 0.5 * seconds[1]).abs() < 1e-9 && restir.time == seconds[1], "{restir:?}");
            assert_eq!(restir.pays(), Some(pays), "{restir:?}");
        }
        let (_, all) = compare(&result(reusing(), [1.0, 1.0], 1.0)).unwrap();
        assert_eq!(all[1].unwrap().pays(), None);
    }

    #[test]
    fn the_better_technique_without_reuse_is_the_baseline() {
        assert_eq!(compare(&result(PathSettings::default(), [1.0, 1.0], 0.5)), None);
        let mut three = result(reusing(), [1.0, 1.0], 0.5);
        let mut slow = three.series[0].clone();
        slow.cells[4].runs.iter_mut().for_each(|run| run.seconds *= 2.0);
        three.series.insert(0, slow);
        assert_eq!(compare(&three).unwrap().0, 1);
    }
}
