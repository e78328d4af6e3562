//! Intervals, and what is known of the difference of noisy images.

use super::{Estimate, mean_and_error};

/// 97.5 % quantiles of Student's t for 1, 2, ... degrees of freedom.
const STUDENT: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131, 2.120,
    2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042,
];
/// The same of the normal distribution.
pub const NORMAL: f64 = 1.960;

/// Half the width of a 95 % interval in standard errors that were estimated with so many degrees of freedom; beyond
/// the table by the expansion of Cornish and Fisher, whose next term is below 0.004 there.
pub fn student(degrees: usize) -> f64 {
    let Some(tabulated) = degrees.checked_sub(1) else { return f64::INFINITY };
    let expansion = || NORMAL + (NORMAL.powi(3) + NORMAL) / (4.0 * degrees as f64);
    STUDENT.get(tabulated).copied().unwrap_or_else(expansion)
}

/// A statistic of so many runs, which is told which of them it is of, and its standard error, from what it is without each of them (Tukey's
/// jackknife; Efron and Stein 1981).
pub fn jackknife(runs: usize, of: impl Fn(&[usize]) -> f64) -> Estimate {
    let (all, count) = ((0..runs).collect::<Vec<_>>(), runs as f64);
    let value = of(&all);
    let without = |out: usize| of(&all.iter().copied().filter(|&run| run != out).collect::<Vec<_>>());
    let pseudo: Vec<f64> = all.iter().map(|&out| count * value - (count - 1.0) * without(out)).collect();
    Estimate { value, error: mean_and_error(&pseudo).1 }
}

/// The mean squared difference of two methods' images, of which `a` and `b` have one a run, over some of the runs. Without the noise of
/// either: it is a mean product of two runs' differences. So it may be negative.
pub fn squared_difference(a: &[Vec<f64>], b: &[Vec<f64>], runs: &[usize]) -> f64 {
    let (count, pairs) = (b[0].len(), (runs.len() * (runs.len() - 1)) as f64);
    let products = |value: usize| {
        let off = runs.iter().map(|&run| a[run][value] - b[run][value]);
        let [sum, squares] = off.fold([0.0, 0.0], |[sum, squares], d| [sum + d, squares + d * d]);
        (sum * sum - squares) / pairs
    };
    (0..count).map(products).sum::<f64>() / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_student() {
        assert!((student(31) - 2.0395).abs() < 0.004 && (student(100) - 1.984).abs() < 0.001);
        assert_eq!((student(1), student(0)), (STUDENT[0], f64::INFINITY));
    }

    /// Of a mean the jackknife knows what everybody knows.
    #[test]
    fn the_jackknife_of_a_mean_is_its_standard_error() {
        let values = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0];
        let mean = |runs: &[usize]| runs.iter().map(|&run| values[run]).sum::<f64>() / runs.len() as f64;
        let (found, (value, error)) = (jackknife(values.len(), mean), mean_and_error(&values));
        assert!((found.value - value).abs() < 1.0e-12 && (found.error - error).abs() < 1.0e-12, "{found:?}");
    }
}
