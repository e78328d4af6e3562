//! Least squares for functions of few parameters, weighted anew until the largest error is small.

/// A function of a point and of its parameters.
pub(crate) struct Model<'a> {
    /// How many points there are.
    pub(crate) points: usize,
    /// What the function should be at each point.
    pub(crate) target: &'a [f64],
    /// The function and its derivatives by the parameters at a point, or nothing where the parameters are not allowed.
    pub(crate) evaluate: &'a Evaluate<'a>,
}

type Evaluate<'a> = dyn Fn(&[f64], usize) -> Option<(f64, Vec<f64>)> + Sync + 'a;

/// The steps of a search, and between changes of the weights.
const STEPS: usize = 800;
const STEPS_A_WEIGHT: usize = 5;
/// Steps before the weights change for the first time.
const FIRST_STEPS: usize = 60;
/// Bounds of the damping: columns are scaled to length 1.
const LEAST_DAMPING: f64 = 1.0e-12;
const MOST_DAMPING: f64 = 1.0e3;

/// Parameters, from `start`, for which the largest error is small: Levenberg and Marquardt's steps on squares whose weights
/// grow where the error is large (Lawson 1961). The parameters of the least such error that was met, and that error.
pub(crate) fn minimax(model: &Model<'_>, start: Vec<f64>) -> (Vec<f64>, f64) {
    let mut weights = vec![1.0; model.points];
    let mut parameters = start;
    let mut damping = 1.0e-2;
    let mut best = (parameters.clone(), f64::INFINITY);
    for step in 0..STEPS {
        let Some(errors) = errors(model, &parameters) else { break };
        let largest = errors.iter().fold(0.0, |max: f64, e| max.max(e.abs()));
        if largest < best.1 {
            best = (parameters.clone(), largest);
        }
        if step > FIRST_STEPS && step % STEPS_A_WEIGHT == 0 {
            reweight(&mut weights, &errors);
        }
        parameters = improved(model, parameters, &errors, &weights, &mut damping);
    }
    best
}

fn errors(model: &Model<'_>, parameters: &[f64]) -> Option<Vec<f64>> {
    (0..model.points).map(|i| (model.evaluate)(parameters, i).map(|(value, _)| value - model.target[i])).collect()
}

fn squares(errors: &[f64], weights: &[f64]) -> f64 {
    errors.iter().zip(weights).map(|(e, w)| w * e * e).sum()
}

fn reweight(weights: &mut [f64], errors: &[f64]) {
    let mean = errors.iter().map(|e| e.abs()).sum::<f64>() / errors.len() as f64;
    weights.iter_mut().zip(errors).for_each(|(w, e)| *w *= (e.abs() / mean + 0.02).sqrt());
    let mean = weights.iter().sum::<f64>() / weights.len() as f64;
    weights.iter_mut().for_each(|w| *w /= mean);
}

/// The parameters after a step that lowers the weighted squares, or the same ones.
fn improved(model: &Model<'_>, parameters: Vec<f64>, old: &[f64], weights: &[f64], damping: &mut f64) -> Vec<f64> {
    let count = parameters.len();
    let mut normal = vec![vec![0.0; count]; count];
    let mut gradient = vec![0.0; count];
    for i in 0..model.points {
        let Some((_, slopes)) = (model.evaluate)(&parameters, i) else { return parameters };
        for (row, a) in slopes.iter().enumerate() {
            gradient[row] -= weights[i] * a * old[i];
            for (column, b) in slopes.iter().enumerate().take(row + 1) {
                normal[row][column] += weights[i] * a * b;
            }
        }
    }
    let scale: Vec<f64> = (0..count).map(|k| normal[k][k].sqrt() + 1.0e-12).collect();
    for row in 0..count {
        gradient[row] /= scale[row];
        for column in 0..=row {
            normal[row][column] /= scale[row] * scale[column];
        }
    }
    for _ in 0..8 {
        let step = solve(&normal, &gradient, *damping);
        let next: Vec<f64> = parameters.iter().zip(step).zip(&scale).map(|((p, s), scale)| p + s / scale).collect();
        if errors(model, &next).is_some_and(|new| squares(&new, weights) < squares(old, weights)) {
            *damping = (*damping * 0.3).max(LEAST_DAMPING);
            return next;
        }
        *damping = (*damping * 4.0).min(MOST_DAMPING);
    }
    parameters
}

/// Solves `(a + damping) x = b` by Cholesky's factors, of a symmetric positive matrix given by its lower half.
fn solve(a: &[Vec<f64>], b: &[f64], damping: f64) -> Vec<f64> {
    let n = b.len();
    let mut l = a.to_vec();
    for row in 0..n {
        for column in 0..=row {
            let sum: f64 = (0..column).map(|k| l[row][k] * l[column][k]).sum();
            let rest = a[row][column] - sum;
            l[row][column] =
                if row == column { (rest + damping).max(f64::MIN_POSITIVE).sqrt() } else { rest / l[column][column] };
        }
    }
    let mut x = b.to_vec();
    for row in 0..n {
        let sum: f64 = (0..row).map(|k| l[row][k] * x[k]).sum();
        x[row] = (x[row] - sum) / l[row][row];
    }
    for row in (0..n).rev() {
        let sum: f64 = (row + 1..n).map(|k| l[k][row] * x[k]).sum();
        x[row] = (x[row] - sum) / l[row][row];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three parameters of a quotient come back from its values.
    #[test]
    fn a_quotient_is_found() {
        let at = |i: usize| i as f64 / 20.0;
        let target: Vec<f64> = (0..=20).map(|i| (1.0 + 2.0 * at(i)) / (1.0 + 3.0 * at(i))).collect();
        let evaluate = |c: &[f64], i: usize| {
            let x = at(i);
            let below = 1.0 + c[2] * x;
            let value = (c[0] + c[1] * x) / below;
            Some((value, vec![1.0 / below, x / below, -value * x / below]))
        };
        let (found, error) = minimax(&Model { points: 21, target: &target, evaluate: &evaluate }, vec![0.0; 3]);
        assert!(error < 1.0e-9, "off by {error:e}");
        assert!(found.iter().zip([1.0, 2.0, 3.0]).all(|(a, b)| (a - b).abs() < 1.0e-6), "{found:?}");
    }
}
