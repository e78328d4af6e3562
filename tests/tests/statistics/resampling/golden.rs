//! One combine that can be checked by hand: three inputs, of which the third cannot be produced by the second's pixel, and
//! the first two of them alone.

use super::support::{keep, near};
use restir_shared::resample::mis::Mis;
use restir_tests::resampling::forms::Form::{self, Library, LiteralContribution, LiteralTalbot};
use restir_tests::resampling::forms::{Input, Real};

const CONFIDENCE: [f64; 3] = [1.0, 4.0, 2.0];
const WEIGHT: [f64; 3] = [0.5, 0.25, 0.8];
/// Of each pixel for each sample.
const TARGET: [[f64; 3]; 3] = [[2.0, 1.0, 0.5], [1.0, 3.0, 0.0], [0.5, 0.4, 1.5]];
/// Of the samples at the canonical pixel.
const VISIBILITY: [f64; 3] = [1.0, 0.0, 1.0];
const TOLERANCE: f64 = 1e-6;

/// A form, the weights by which it selects, what their sum is multiplied by if a sample is selected, and the averaged
/// visibility, where averaging is allowed.
type Golden = (Form, &'static [f64], &'static [f64], Option<f64>);

const LIBRARY: [Golden; 11] = [
    (Library(Mis::ONE_OVER_M), &[1.0, 1.0, 0.8], &[1.0 / 7.0; 3], Some(0.642_857_1)),
    (Library(Mis::ONE_OVER_Z), &[1.0, 1.0, 0.8], &[1.0 / 7.0, 1.0 / 7.0, 1.0 / 3.0], None),
    (Library(Mis::CONTRIBUTION), &[1.0, 1.0, 0.8], &[2.0 / 7.0, 5.0 / 23.0, 3.0 / 7.0], None),
    (Library(Mis::TALBOT), &[0.285_714_3, 0.217_391_3, 0.342_857_1], &[1.0; 3], Some(0.743_025_0)),
    (Library(Mis::CONSTANT), &[0.142_857_1, 0.142_857_1, 0.114_285_7], &[1.0; 3], Some(0.642_857_1)),
    (Library(Mis::PAIRWISE), &[0.3, 0.157_894_7, 0.126_315_8], &[1.0; 3], Some(0.729_729_7)),
    (Library(DEFENSIVE), &[0.4, 0.135_338_3, 0.108_270_7], &[1.0; 3], Some(0.789_719_6)),
    (Library(Mis::PAIRWISE_COUNTED), &[0.35, 0.12, 0.184_615_4], &[1.0; 3], Some(0.816_686_3)),
    (Library(COUNTED_DEFENSIVE), &[0.566_666_7, 0.08, 0.123_076_9], &[1.0; 3], Some(0.896_069_3)),
    // two inputs: the balance heuristic of Tokuyoshi's Algorithm 1
    (Library(Mis::TALBOT), &[0.333_333_3, 0.230_769_2], &[1.0; 2], Some(0.590_909_1)),
    // two inputs: the defensive balance heuristic of bevy is the defensive pairwise form
    (Library(DEFENSIVE), &[0.466_666_7, 0.184_615_4], &[1.0; 2], None),
];
const DEFENSIVE: Mis = Mis::PAIRWISE_DEFENSIVE;
const COUNTED_DEFENSIVE: Mis = Mis::PAIRWISE_COUNTED_DEFENSIVE;

const LITERAL: [Golden; 2] = [
    (LiteralContribution, &[1.0, 1.0, 0.8], &[4.0 / 7.0, 15.0 / 22.0, 0.75], None),
    (LiteralTalbot, &[1.714_286, 2.045_455, 1.8], &[1.0 / 7.0; 3], Some(0.632_095_3)),
];

fn check<T: Real>(&(form, weights, shares, average): &Golden) {
    let k = weights.len();
    let inputs: Vec<Input<T>> = (0..k)
        .map(|i| Input { confidence: T::of(CONFIDENCE[i]), contribution: T::of(TARGET[0][i]) * T::of(WEIGHT[i]) })
        .collect();
    let equal = |what: &str, i: usize, value: T, wanted: f64| {
        let value: f64 = value.into();
        assert!(near(value, wanted, TOLERANCE), "{} of {k}, {what} {i}: {value} for {wanted}", form.name());
    };
    let sum: f64 = weights.iter().sum();
    for (selected, &share) in shares.iter().enumerate() {
        let combined = form.combine(&inputs, |j, i| T::of(TARGET[j][i]), keep(selected));
        for (i, &weight) in weights.iter().enumerate() {
            equal("weight", i, combined.weights[i], weight);
        }
        equal("sum", 0, combined.reservoir.weight_sum, sum);
        equal("confidence", 0, combined.reservoir.confidence, CONFIDENCE[..k].iter().sum());
        assert!(combined.reservoir.sample == selected, "{selected} is not selected");
        let target = TARGET[0][selected];
        let weight = combined.reservoir.contribution_weight(combined.share, T::of(target));
        equal("contribution weight", selected, weight, sum * share / target);
        if let Some(average) = average {
            equal("average", 0, combined.average(k, |i| T::of(VISIBILITY[i])), average);
        }
    }
}

fn check_all(list: &[Golden]) {
    list.iter().for_each(check::<f32>);
    list.iter().for_each(check::<f64>);
}

pub(crate) fn golden_values() {
    check_all(&LIBRARY);
}

pub(crate) fn literal_algorithms_have_their_values() {
    check_all(&LITERAL);
}
