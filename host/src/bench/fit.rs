//! What a row of measurements says: means and medians, the slope of a convergence, the time to an error.

/// 97.5 % quantiles of Student's t for 1, 2, ... degrees of freedom.
const STUDENT: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131, 2.120,
    2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042,
];
const NORMAL: f64 = 1.960;

/// A number with the half width of its 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Estimate {
    pub(crate) value: f64,
    pub(crate) half_width: f64,
}

/// The mean and its standard error, which is NaN for fewer than two values.
pub(crate) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (count * (count - 1.0))).sqrt())
}

/// The median; NaN of nothing.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.get(middle) {
        None => f64::NAN,
        Some(&upper) if sorted.len() % 2 == 1 => upper,
        Some(&upper) => 0.5 * (sorted[middle - 1] + upper),
    }
}

/// The slope of the least-squares line.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
    let across: f64 = points.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    let along: f64 = points.iter().map(|(x, _)| (x - mx).powi(2)).sum();
    across / along
}

/// The exponent with which the root of an error falls with the number of samples, from squared errors
/// `squared[budget][restart]`: the least-squares slope of log(RMSE) over log(samples), where the RMSE of a budget is
/// that of its restarts together. The interval is the jackknife's (Efron and Stein 1981) over restarts.
///
/// `None` for fewer than three budgets or two restarts, or where an error is not positive.
pub(crate) fn convergence(samples: &[f64], squared: &[Vec<f64>]) -> Option<Estimate> {
    let restarts = squared.iter().map(Vec::len).min()?;
    if samples.len() < 3 || restarts < 2 {
        return None;
    }
    let without = |left_out: Option<usize>| {
        let mean = |row: &Vec<f64>| {
            let kept = row.iter().take(restarts).enumerate().filter(|(i, _)| Some(*i) != left_out);
            kept.map(|(_, value)| value).sum::<f64>() / (restarts - usize::from(left_out.is_some())) as f64
        };
        let points = samples.iter().zip(squared).map(|(n, row)| (n.ln(), 0.5 * mean(row).ln()));
        slope(&points.collect::<Vec<_>>())
    };
    let value = without(None);
    let parts: Vec<f64> = (0..restarts).map(|restart| without(Some(restart))).collect();
    let (_, error) = mean_and_error(&parts);
    let half_width = student(restarts - 1) * error * (restarts - 1) as f64;
    (value.is_finite() && half_width.is_finite()).then_some(Estimate { value, half_width })
}

pub(super) fn student(degrees: usize) -> f64 {
    degrees.checked_sub(1).and_then(|i| STUDENT.get(i)).copied().unwrap_or(NORMAL)
}

/// The time at which an error is reached, by a power law between the two measurements (time, error) around it;
/// `None` outside of what was measured.
pub(crate) fn time_to_error(points: &[(f64, f64)], target: f64) -> Option<f64> {
    points.windows(2).find_map(|pair| {
        let [(t0, e0), (t1, e1)] = [pair[0], pair[1]];
        if !(e0 >= target && target >= e1 && e1 > 0.0) {
            return None;
        }
        let part = if e0 == e1 { 0.0 } else { (e0 / target).ln() / (e0 / e1).ln() };
        Some(t0 * (t1 / t0).powf(part))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::noise::Noise;

    const SAMPLES: [f64; 7] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];

    /// Squared errors around 1 / n + `floor` with a relative deviation of `spread`.
    fn errors(noise: &mut Noise, restarts: usize, spread: f64, floor: f64) -> Vec<Vec<f64>> {
        let mut row = |n: f64| (0..restarts).map(|_| (1.0 / n + floor) * (1.0 + spread * noise.normal())).collect();
        SAMPLES.iter().map(|&n| row(n)).collect()
    }

    #[test]
    fn an_exact_power_law_has_its_exponent() {
        let fit = convergence(&SAMPLES, &errors(&mut Noise::new(1), 4, 0.0, 0.0)).unwrap();
        assert!((fit.value + 0.5).abs() < 1e-12 && fit.half_width < 1e-12, "{fit:?}");
    }

    #[test]
    fn the_interval_holds_the_exponent_as_often_as_it_says() {
        let mut noise = Noise::new(2);
        let trials = 400;
        let held = (0..trials)
            .filter(|_| {
                let fit = convergence(&SAMPLES, &errors(&mut noise, 8, 0.1, 0.0)).unwrap();
                (fit.value + 0.5).abs() <= fit.half_width
            })
            .count();
        // 95 % of 400 are 380 with a deviation of 4.4
        assert!((362..=398).contains(&held), "{held} of {trials}");
    }

    #[test]
    fn noise_of_a_reference_that_is_not_subtracted_is_seen_as_another_exponent() {
        // a floor of 5 % of the smallest error
        let wrong = convergence(&SAMPLES, &errors(&mut Noise::new(3), 8, 0.002, 0.05 / 64.0)).unwrap();
        assert!(wrong.value - wrong.half_width > -0.5, "{wrong:?}");
    }

    #[test]
    fn too_little_gives_no_slope() {
        let rows = errors(&mut Noise::new(4), 1, 0.1, 0.0);
        assert_eq!(convergence(&SAMPLES, &rows), None);
        assert_eq!(convergence(&SAMPLES[..2], &errors(&mut Noise::new(4), 4, 0.1, 0.0)[..2]), None);
        assert_eq!(convergence(&SAMPLES, &vec![vec![0.0; 4]; 7]), None);
        assert_eq!(convergence(&[], &[]), None);
    }

    #[test]
    fn times_are_interpolated_by_a_power_law_and_never_extrapolated() {
        let points: Vec<_> = SAMPLES.iter().map(|n| (0.1 * n, 1.0 / n)).collect();
        let time = time_to_error(&points, 1.0 / 24.0).unwrap();
        assert!((time - 2.4).abs() < 1e-12, "{time}");
        assert_eq!(time_to_error(&points, 2.0), None);
        assert_eq!(time_to_error(&points, 1e-3), None);
        assert_eq!(time_to_error(&[], 1.0), None);
    }

    #[test]
    fn medians_and_means() {
        assert_eq!((median(&[3.0, 1.0, 2.0]), median(&[4.0, 1.0, 2.0, 3.0])), (2.0, 2.5));
        assert!(median(&[]).is_nan());
        assert_eq!(mean_and_error(&[1.0, 3.0]), (2.0, 1.0));
        assert!(mean_and_error(&[1.0]).1.is_nan());
    }
}
