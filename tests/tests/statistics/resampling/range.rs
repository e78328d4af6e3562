//! The ends of the range of weights, in `f32`.

use super::support::MIS;
use restir_shared::resample::mis::Mis;
use restir_shared::resample::reservoir::Reservoir;
use restir_tests::random::SplitMix;
use restir_tests::resampling::forms::{Combined, Form, Input};

const CASES: u64 = 200_000;
/// The range of weights.
const RANGE: std::ops::RangeInclusive<f32> = 7.888_609e-31..=1.267_650_6e30;
/// Zero, subnormal and normal numbers around the ends of the range, and beyond.
const ENDS: [f32; 14] = [
    0.0,
    1e-45,
    1e-39,
    f32::MIN_POSITIVE,
    7.888_608e-31,
    7.888_609e-31,
    1e-20,
    1.0,
    3.0,
    1e20,
    1.267_650_6e30,
    1.3e30,
    1e38,
    f32::MAX,
];
/// Confidence at the ends of its range.
const CONFIDENCE: [f32; 5] = [0.0, 9.536_743e-7, 1.0, 20.0, 1_048_576.0];

fn pick<T: Copy>(random: &mut SplitMix, of: &[T]) -> T {
    of[random.below(of.len())]
}

/// A combine of three whose numbers are among the given ones.
fn combined(mis: Mis, numbers: &[f32], random: &mut SplitMix) -> Combined<f32> {
    let mut inputs =
        [(); 3].map(|()| Input { confidence: pick(random, &CONFIDENCE), contribution: pick(random, numbers) });
    inputs[0].confidence = pick(random, &CONFIDENCE[1..]);
    let a = [(); 9].map(|()| pick(random, numbers));
    Form::Library(mis).combine(&inputs, |j, i| a[3 * j + i], || random.unit() as f32)
}

fn is_weight(x: f32) -> bool {
    (x == 0.0) | RANGE.contains(&x)
}

fn check(numbers: &[f32]) {
    for index in 0..CASES {
        let mut random = SplitMix::new(index);
        let mis = pick(&mut random, &MIS);
        let combined = combined(mis, numbers, &mut random);
        let target = pick(&mut random, numbers);
        let weight = combined.reservoir.contribution_weight(combined.share, target);
        let fits = combined.weights.into_iter().all(is_weight) & is_weight(weight) & is_weight(combined.share);
        let is_finite = combined.reservoir.weight_sum.is_finite() & combined.reservoir.confidence.is_finite();
        assert!(fits & is_finite, "{mis:?}, case {index}: {combined:?}, {weight}");
    }
}

pub(crate) fn nothing_leaves_the_range() {
    check(&ENDS);
    let mut reservoir = Reservoir::empty(0);
    for i in 0..1_000_000 {
        reservoir.update(i, f32::MAX, 1.0, 0.5);
    }
    let sum = reservoir.weight_sum;
    assert!(sum.is_finite(), "10^6 of the largest weights sum to {sum}");
}

pub(crate) fn what_is_no_number_counts_as_zero() {
    let mut numbers = ENDS.to_vec();
    numbers.extend([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0]);
    check(&numbers);
    let mut reservoir = Reservoir::empty(0);
    let kept = reservoir.update(1, f32::NAN, 1.0, 0.0) | reservoir.update(1, -1.0, 1.0, 0.0);
    assert!(!kept & (reservoir.weight_sum == 0.0), "{reservoir:?}");
}

/// A sample with a weight that no input claims to produce: what targets say at one time and not at another, say after a
/// light has moved, counts nothing rather than everything.
pub(crate) fn what_nobody_produces_counts_nothing() {
    let inputs = [Input { confidence: 1.0_f32, contribution: 1.0 }; 3];
    for mis in [Mis::ONE_OVER_Z, Mis::CONTRIBUTION, Mis::TALBOT] {
        let combined = Form::Library(mis).combine(&inputs, |_, _| 0.0, || 0.5);
        let weight = combined.reservoir.contribution_weight(combined.share, 1.0);
        assert!(weight == 0.0, "{mis:?}: the weight is {weight}");
    }
}

/// Contributions or targets times 2^40 or 2^-40: the same inputs are selected, by weights that differ by just that.
pub(crate) fn selection_does_not_depend_on_the_scale() {
    for index in 0..CASES {
        let mut random = SplitMix::new(index);
        let mis = pick(&mut random, &MIS);
        let mut number = |zeros: usize| {
            if random.below(4) < zeros { 0.0 } else { random.range(-8.0, 8.0).exp2() as f32 }
        };
        let contributions = [number(1), number(1), number(1)];
        let a: [f32; 9] = std::array::from_fn(|_| number(1));
        let confidence = [number(0), number(1), number(1)];
        let us = [(); 3].map(|()| random.unit() as f32);
        let run = |contribution: f32, target: f32| {
            let inputs: [Input<f32>; 3] = std::array::from_fn(|i| Input {
                confidence: confidence[i],
                contribution: contributions[i] * contribution,
            });
            let mut u = us.into_iter();
            Form::Library(mis).combine(&inputs, |j, i| a[3 * j + i] * target, || u.next().expect("three numbers"))
        };
        let plain = run(1.0, 1.0);
        for scale in [40.0_f64.exp2() as f32, (-40.0_f64).exp2() as f32] {
            let scaled = [run(scale, 1.0), run(1.0, scale)];
            for (factor, other) in [scale, 1.0].into_iter().zip(scaled) {
                let same = (other.reservoir.sample == plain.reservoir.sample)
                    & (other.reservoir.weight_sum == plain.reservoir.weight_sum * factor)
                    & (other.share == plain.share);
                assert!(same, "{mis:?}, case {index}: {plain:?} and {other:?}");
            }
        }
    }
}
